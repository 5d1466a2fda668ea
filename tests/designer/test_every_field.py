"""Each plain field of a form changes and shows its own key; one undo reverts it, and a redo repeats it.

`test_buttons.py` has the buttons of a form.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

import pytest
from PySide6.QtWidgets import QApplication, QLabel

from study_app.designer.document.fields import label_of, unit_of
from study_app.protocol.source.document import Path
from study_app.protocol.wording import language_name
from tests.designer.document.test_commands import elements
from tests.protocol.edited_studies import text_of

pytestmark = pytest.mark.slow

TYPED: dict[str, tuple[str, Any]] = {
    "text": ("other", "other"), "number": ("7.25", 7.25), "whole number": ("7", 7), "numbers": ("7.5 9", (7.5, 9)),
    "vector": ("1 2 3", (1, 2, 3)),
}  # fmt: skip
"""What is typed into a line, by the kind of its value, and that value."""


def leaves(value: Any, path: Path = ()) -> Iterator[tuple[Path, Any]]:
    """Yield each plain value of a study with its path."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from leaves(inner, (*path, key))
    elif isinstance(value, tuple) and any(isinstance(entry, Mapping) for entry in value):
        for at, inner in enumerate(value):
            yield from leaves(inner, (*path, at))
    else:
        yield path, value


def uses(designer: Any, field: Any) -> Iterator[tuple[Callable[[Any], object], Any]]:
    """Yield each input of a user into a field, and the resulting value of its key; a text by its language."""
    row, kind = field.row, type(field).__name__
    if kind == "LineField" and row.kind in TYPED:
        text, value = TYPED[row.kind]
        yield lambda field: designer.fill(field.line, text), value
    elif kind == "LanguagesField":
        for code, line in field.lines.items():
            assert line.placeholderText() == f"Missing in {language_name(code)}"
            assert line.toolTip() == language_name(code)
            yield partial(_fill_in, designer, code=code), {code: "Other"}
    elif kind == "SwitchField":
        yield lambda field: field.toggle.click(), not (row.default if row.value is None else row.value)
    elif kind == "ChoiceField" and row.kind != "reference":
        for choice in row.choices[-2:]:
            if choice.value not in {None, row.default if row.value is None else row.value}:
                yield partial(_choose, words=label_of(choice.value)), choice.value
    elif kind == "ChecksField":
        chosen = row.default if row.value is None else row.value
        for name in (str(row.choices[0].value), str(row.choices[-1].value)):
            without = tuple(value for value in chosen if value != name)
            yield lambda field, name=name: field.checks[name].click(), (*without, *[name] * (name not in chosen))


def _fill_in(designer: Any, field: Any, code: str) -> None:
    designer.fill(field.lines[code], "Other", "")
    field.lines[code].flush()


def _choose(field: Any, words: str) -> None:
    """Choose a value by its label, as a person does."""
    box, segments = field.list, field.segments
    if segments is not None and (box is None or segments.isVisible()):
        next(button for button in segments.buttons if button.text().startswith(words)).click()
    else:
        box.activated.emit(next(at for at in range(box.count()) if box.itemText(at).startswith(words)))


def shown_value(field: Any) -> Any:
    """Return the shown value of a field."""
    match type(field).__name__:
        case "LineField":
            return field.line.typed_text()
        case "LanguagesField":
            return [line.typed_text() for line in field.lines.values()]
        case "SwitchField":
            return field.toggle.isChecked()
        case "ChecksField":
            return [check.isChecked() for check in field.checks.values()]
        case "ChoiceField" if field.list is None:
            return [button.isChecked() for button in field.segments.buttons]
    return field.list.currentText()


def test_each_field_changes_its_own_key(designer: Any) -> None:
    known: set[tuple[Any, ...]] = set()
    for name in ("demo", "every_design"):
        file = designer.file.with_name(f"{name}.toml")
        file.write_text(
            text_of(name).replace('languages = ["en"]', 'languages = ["en", "nl"]'), encoding="utf-8", newline="\n"
        )
        designer.open(name)
        for path in elements(designer.study.document):
            designer.go_to(*path)
            for part in [*designer.place.form.rows]:
                row = part.row
                kind = (type(part.field), row.kind, row.default is None, row.value is None, bool(row.unit))
                if kind not in known:
                    known.add(kind)
                    _use_field(designer, row.path)
                    designer.go_to(*path)
    assert len(known) > 30


def _use_field(designer: Any, path: Path) -> None:
    """Change a field in each possible way; check the key, the field and the step."""
    row = designer.form_row(*path)
    if type(row.field).__name__ == "LineField" and row.row.unit:
        assert unit_of(str(path[-1])) in [part.text() for part in row.field.findChildren(QLabel)]
    for use, value in uses(designer, row.field):
        before, text, was = dict(leaves(designer.study.document)), designer.text, shown_value(designer.field(*path))
        use(designer.field(*path))
        QApplication.processEvents()
        now, after = designer.value(*path), dict(leaves(designer.study.document))
        if isinstance(value, dict):
            assert now.items() >= value.items(), path
        else:
            assert now == value, path
        different = {key for key in before.keys() | after.keys() if before.get(key) != after.get(key)}
        if path[-1] in {"kind", "design", "phase"}:  # other keys of its table come and go with it
            assert {key[: len(path) - 1] for key in different if key[0] == path[0]} == {path[:-1]}
        else:
            assert {key[: len(path)] for key in different} == {path}
        if row.row.kind != "kind":
            assert designer.steps[-1] in {f"Change {row.row.label}", f"Type {row.row.label}"}
        changed, then = designer.text, shown_value(designer.field(*path))
        assert then != was
        for go, expected in ((designer.editing.undo, (text, was)), (designer.editing.redo, (changed, then))):
            go()
            QApplication.processEvents()
            assert (designer.text, shown_value(designer.field(*path))) == expected, path
        designer.undo_all()
