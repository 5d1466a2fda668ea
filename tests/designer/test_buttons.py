"""Every button of a form changes what its name says and nothing else; one undo takes it back, and a redo repeats it."""

import re
from collections.abc import Mapping
from copy import deepcopy
from functools import reduce
from operator import getitem
from typing import Any

import pytest
from PySide6.QtWidgets import QAbstractButton, QApplication, QLabel

from study_app.designer.document.fields import Row, rows
from study_app.designer.document.steps import ChangeLanguage
from study_app.designer.document.toml_edits import Set
from study_app.protocol.source.document import Path
from tests.designer.support.inputs import name_of
from tests.gui.walk import upright

pytestmark = pytest.mark.slow

OPENS_ELSEWHERE = re.compile("Open |Glossary$|Series |Feel |Delete$|Add Trial design$|.*…$")
"""Buttons that only open something, Delete, which may ask first, and a trial design, which adds more than itself."""
CONDITIONS = ("late", "thin", "prompt", "thick")


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(inner) for key, inner in value.items()}
    return [_plain(inner) for inner in value] if isinstance(value, list | tuple) else value


def _at(study: Any, path: Path) -> Any:
    return reduce(getitem, path, study)


def _lists(value: Any) -> list[list[Any]]:
    """Return a list, or the lists of each language."""
    return [value] if isinstance(value, list) else list(value.values())


def _move(items: list[Any], at: int, name: str) -> None:
    items.insert(at + (1 if name.endswith("down") else -1), items.pop(at))


def _expected(before: Any, after: Any, path: Path, row: Row | None, at: int | None, name: str) -> Any:
    """Return the expected document after a button; contents of a new element are taken from ``after``."""
    study = deepcopy(before)
    element, parent = _at(study, path), _at(study, path[:-1])
    is_entry = isinstance(path[-1], int)
    order = parent if is_entry else study["sequence"]
    match name.split():
        case ["Move", *_] if row is not None:
            _move(_at(study, row.path), at, name)
        case ["Move", *_]:
            _move(order, path[-1] if is_entry else order.index(path[-1]), name)
        case ["Duplicate"] if is_entry:
            parent.insert(path[-1] + 1, element | {"id": _at(after, (*path[:-1], path[-1] + 1))["id"]})
        case ["Duplicate"]:
            ids = list(_at(after, path[:-1]))
            copy = ids[ids.index(path[-1]) + 1]
            assert copy not in parent
            own = {key: _at(after, (*path[:-1], copy))[key] for key in ("code_prefix",) if key in element}
            assert all(own[key] != element[key] for key in own)
            parent[copy] = element | own
            if path[-1] in order:
                order.insert(order.index(path[-1]) + 1, copy)
        case ["Remove", "Point", number] if row is not None:
            for labels in _lists(_at(study, row.path)):
                del labels[int(number) - 1]
        case ["Remove", *_] if at is not None and row is not None:
            del _at(study, row.path)[at]
        case ["Remove", *label, "from", "the", "file"]:
            sections = (section.path for section in rows(before, path) if section.label == " ".join(label))
            gone = next(sections) if row is None else row.path
            assert row is None or row.label == " ".join(label)
            del _at(study, gone[:-1])[gone[-1]]
        case ["Add", *_] if row is not None and row.value is None:
            assert len(_at(after, row.path)) == 1
            return _with(study, row.path, _at(after, row.path))
        case ["Add", *_] if row is not None:
            for labels, more in zip(_lists(_at(study, row.path)), _lists(_at(after, row.path)), strict=True):
                labels.append(more[-1])
        case ["Add", *label]:
            key = next(field.path[-1] for field in rows(before, path) if field.label == " ".join(label))
            assert key not in element
            element[key] = _at(after, (*path, key))
        case _ if row is not None and row.instead and row.label != name:
            key = next(field.path[-1] for field in rows(before, path) if field.label == name)
            del element[row.path[-1]]
            element[key] = _at(after, (*path, key))
        case _ if row is not None and row.label != name and row.choices:
            chosen = str(_at(after, row.path))
            assert re.sub(r"\W", "", name).lower().startswith(re.sub(r"\W", "", chosen))
            holder = path if row.path[: len(path)] == path else row.path[:-1]
            return _with(study, holder, _at(after, holder))
        case _ if row is not None and row.label == name:
            return _with(study, row.path, not (row.default if row.value is None else row.value))
        case _:
            pytest.fail(f"no rule for the button {name!r} of {path}")
    return study


def _with(study: Any, path: Path, value: Any) -> Any:
    parent = study if len(path) == 1 else study.setdefault(path[0], {}) if len(path) == 2 else _at(study, path[:-1])
    parent[path[-1]] = value
    return study


def _usable_buttons(designer: Any) -> dict[tuple[Any, Any, str], QAbstractButton]:
    """Return the buttons of the form that can be pressed, by path of the row, number of the entry, and name."""
    buttons = {}
    for button in designer.place.form.findChildren(QAbstractButton):
        if button.isVisible() and button.isEnabled() and name_of(button) and not button.isChecked():
            row = next((row for row in designer.place.form.rows if row.isAncestorOf(button)), None)
            entries = getattr(getattr(row, "field", None), "rows", None)
            at = None
            if isinstance(entries, list):
                at = next((place for place, entry in enumerate(entries) if entry.isAncestorOf(button)), None)
            buttons[None if row is None else row.row.path, at, name_of(button)] = button
    return buttons


@pytest.mark.parametrize(
    "path",
    [
        ("blocks", "liquids"),
        ("conditions", "thin"),
        ("limits",),
        ("pages", "reaching"),
        ("questionnaires", "liquid"),
        ("questionnaires", "liquid", "items", 1),
        ("scales", "agreement"),
    ],
    ids=str,
)
def test_each_button_of_a_form_changes_the_key_that_it_names(designer: Any, path: Path) -> None:
    designer.open("kitchen")
    designer.editing.make_step("Change", Set(("blocks", "liquids", "conditions"), CONDITIONS))
    designer.go_to(*path)
    before, text, editing = _plain(designer.study.document), designer.text, designer.editing
    repeated: set[str] = set()
    for of_row, at, name in _usable_buttons(designer):
        if OPENS_ELSEWHERE.match(name):
            continue
        designer.go_to(*path)
        row = None if of_row is None else designer.form_row(*of_row).row
        _usable_buttons(designer)[of_row, at, name].click()
        QApplication.processEvents()
        changed, after = designer.text, _plain(designer.study.document)
        if changed == text:
            assert designer.messages or designer.form_row(*of_row).fault_line.isVisible(), (of_row, name)
            continue
        assert after == _expected(before, after, path, row, at, name), (of_row, at, name)
        editing.undo()
        assert designer.text == text, (of_row, at, name)
        if name.split()[0] not in repeated:
            repeated.add(name.split()[0])
            editing.redo()
            assert designer.text == changed, (of_row, at, name)
            editing.undo()
    assert repeated


def test_each_entry_of_a_questionnaires_menu_asks_it_where_the_entry_says(designer: Any) -> None:
    designer.open("kitchen", "questionnaires", "liquid")
    text, block, places = designer.text, ("blocks", "delays", "questionnaire"), {}
    for at, words in enumerate([entry.text() for entry in designer.place.form.head.asks.actions()]):
        designer.place.form.head.asks.actions()[at].trigger()
        places[words.partition("\t")[0]] = " ".join(designer.value("sequence")), designer.value(*block)
        designer.editing.undo()
        assert designer.text == text
    assert places == {
        "Before the first block": ("welcome liquid liquids reaching delays thanks", "delay"),
        "After each trial of Delays": ("welcome liquids reaching delays thanks", "liquid"),
        "After Liquids": ("welcome liquids liquid reaching delays thanks", "delay"),
        "After Delays": ("welcome liquids reaching delays liquid thanks", "delay"),
        "After each block": ("welcome liquids liquid reaching delays liquid thanks", "delay"),
        "At the end": ("welcome liquids reaching delays liquid thanks", "delay"),
    }


def test_no_button_of_the_designer_asks_for_more_height_than_width(designer: Any) -> None:
    designer.open("kitchen", "blocks", "liquids")
    assert upright(designer.place) == []


UNITS = {"mm": "mm", "s": "s", "ms": "ms", "n": "N", "hz": "Hz", "percent": "%", "nspm": "N·s/m", "kg_m3": "kg/m³"}


def test_each_number_of_a_form_has_the_unit_of_its_key_beside_it(designer: Any) -> None:
    designer.open("kitchen")
    units = set()
    for path in (("device",), ("limits",), ("liquids", "thin"), ("conditions", "late"), ("tasks", "reach")):
        designer.go_to(*path)
        for part in designer.place.form.rows:
            key = str(part.row.path[-1])
            unit = next((unit for suffix, unit in UNITS.items() if key.endswith(f"_{suffix}")), "")
            texts = {label.text() for label in part.findChildren(QLabel) if not label.isHidden()}
            if part.row.kind in {"number", "whole number"}:
                assert texts & {*UNITS.values()} == {unit} - {""}, part.row.path
                units.add(unit)
    assert units == {"", "mm", "s", "ms", "N", "Hz", "%", "kg/m³"}


CODES = {"Dutch": "nl", "German": "de"}


def test_each_button_of_a_language_copies_to_or_removes_the_language_that_it_names(designer: Any) -> None:
    designer.open("kitchen")
    for code in ("nl", "de"):
        designer.editing.handle_request(ChangeLanguage("add", code))
    designer.go_to("study")
    text, words, names = designer.text, designer.value("pages", "welcome", "title", "en"), set()
    for key in [key for key in _usable_buttons(designer) if {"Dutch", "German"} & set(key[-1].split())]:
        designer.go_to("study")
        _usable_buttons(designer)[key].click()
        match key[-1].split():
            case ["Copy", "the", "English", "text", "wherever", language, "is", "missing"]:
                assert designer.value("pages", "welcome", "title") == {"en": words, CODES[language]: words}
            case ["Remove", language, "from", "every", "text"]:
                assert designer.value("study", "languages") == ("en", *({"nl", "de"} - {CODES[language]}))
            case ["Write", *_]:
                assert designer.editing.opened.selected == ("study", "languages"), "the list of missing texts"
                names.add(key[-1])
                continue
            case _:
                pytest.fail(key[-1])
        names.add(key[-1])
        designer.editing.undo()
        assert designer.text == text
    assert len(names) == 6, names
