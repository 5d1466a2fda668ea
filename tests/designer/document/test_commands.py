"""Every command of the designer at every kind of element: its effect on the document, undo, and its texts."""

from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path as File
from typing import Any

import pytest

from study_app.designer.document.additions import number_rows
from study_app.designer.document.document import Document
from study_app.designer.document.elements import existing_path
from study_app.designer.document.fields import Row, references_to, rows
from study_app.designer.document.steps import (
    AddElement,
    AddEntry,
    AddInstrument,
    AddKey,
    AddNamed,
    ChangeLanguage,
    DeleteElement,
    DuplicateElement,
    MakeSeries,
    MoveElement,
    RemoveKey,
    RenameElement,
    Request,
    SetText,
    SetValue,
    Step,
    StepContext,
    SwitchKey,
    SwitchKind,
)
from study_app.designer.document.study import Study, read_study
from study_app.designer.document.toml_edits import Edit
from study_app.designer.measures.study_facts import missing_texts
from study_app.designer.outline import addable_elements
from study_app.errors import StudyError
from study_app.protocol.source.document import Path, entries, value_at
from study_app.protocol.wording.languages import languages_of
from tests.designer.document.grown import PROTOCOLS
from tests.golden import compare, each_once
from tests.golden_values import one_line
from tests.protocol.edited_studies import text_of

GOLDEN = File(__file__).parent / "golden"
TABLES = ("study", "device", "scene", "limits", "analysis")
OTHER: dict[str, Any] = {"number": 0.75, "whole number": 3, "text": "other", "switch": True, "choice": "other"}


SMALL = ("rows", "sound", "mixed", "every_design", "grouped")
"""Studies that together have every kind of element, and are short."""


def studies(names: Iterable[str]) -> Iterator[tuple[str, Study]]:
    return ((name, read_study(text_of(name).encode(), PROTOCOLS)) for name in names)


def elements(document: Mapping[str, Any]) -> Iterator[Path]:
    """Yield the path of each element of a study: its tables, those of its sections, and entries of their lists."""
    for row in rows(document, ()):
        if row.kind != "tables":
            yield row.path
            continue
        for path, _ in entries(document, f"{row.path[0]}.*"):
            yield path
            lists = (row for row in rows(document, path) if row.kind == "list" and isinstance(row.value, tuple))
            yield from ((*row.path, at) for row in lists for at in range(len(row.value)))


def of_row(row: Row, document: Mapping[str, Any]) -> Iterator[Request]:
    """Yield the requests that a row of a form can make."""
    path, value = row.path, row.value
    if value is not None:
        yield RemoveKey(path)
    elif row.kind != "kind":
        yield AddKey(path)
    if row.kind in OTHER and value is not None:
        yield SetValue(path, next((choice.value for choice in row.choices if choice.value != value), OTHER[row.kind]))
    if row.kind == "kind":
        yield from (SwitchKind(path[:-1], choice.value) for choice in row.choices if choice.value != value)
    if row.kind == "either":
        yield from (SetValue(path, option.default) for option in row.either if option.default not in (None, value))
    if row.kind in ("localised", "text", "paragraphs"):
        yield SetText(path, "nl", "Een andere tekst")
        yield SetText(path, "en", "Another text")
    if row.instead:
        yield SwitchKey(path, row.instead)
    if row.kind in ("reference", "references"):
        yield from (AddNamed(path, section) for section in row.sections)
    if (isinstance(value, tuple) and value) or row.kind == "list":
        yield AddEntry(path)
    if row.kind == "table" and value is not None:
        for inner in rows(document, path):
            yield from of_row(inner, document)


def of_element(study: Study, path: Path) -> Iterator[Request]:
    """Yield the requests that concern an element."""
    document = study.document
    for row in rows(document, path):
        yield from of_row(row, document)
    if len(path) == 1:
        return
    yield DuplicateElement(path)
    yield from (MoveElement(path, by) for by in (-1, 1))
    yield from (DeleteElement(path, how) for how in ("gaps", "all"))
    yield RenameElement(path, "renamed")
    yield from (MakeSeries(path, row.path, (3, 7, 20)) for row in number_rows(document, path)[:2])
    others = [entry for entry, _ in entries(document, f"{path[0]}.*") if entry[1] != path[1]]
    if others and len(path) == 2:
        other = str(others[0][1])
        yield DeleteElement(path, "other", other)
        yield RenameElement(path, other)


def of_study(study: Study) -> Iterator[Request]:
    yield from (ChangeLanguage(how, code) for how, code in (("add", "de"), ("remove", "nl"), ("copy", "nl")))


def generic(path: Path) -> Path:
    """Return a path without names, so that each kind of element is tested once."""
    return tuple(
        "*" if (at == 1 and len(path) > 1 and path[0] not in TABLES) or isinstance(step, int) else step
        for at, step in enumerate(path)
    )


def every_request(study: Study) -> Iterator[tuple[Path, Request, Any]]:
    """Yield each request with the selected element and the element that it concerns.

    All that can be added is added at the first kind of place that offers it, and at each kind of place one thing is.
    """
    for request in of_study(study):
        yield ("study",), request, ()
    offered: set[Path] = set()
    added: set[Any] = set()
    for path in elements(study.document):
        for request in of_element(study, path):
            yield path, request, generic(getattr(request, "path", ()))
        if generic(path) in offered:
            continue
        offered.add(generic(path))
        for addition in addable_elements(study, path):
            place = (*generic(path)[:1], addition.label.partition(" of ")[0])
            if isinstance(addition.asks, AddElement | AddInstrument) and not added.issuperset(place):
                added.update(place)
                yield path, addition.asks, place


def edited(study: Study, *edits: Edit, text: str | None = None) -> Study:
    """Return a study after a step; check that undo, redo and reading the text again agree with it."""
    document = Document(study)
    document.edit("Step", *edits, text=text)
    after = document.study
    if document.done:
        document.undo()
        assert document.study.text == study.text, "undone"
        document.redo()
        assert document.study.text == after.text, "done again"
    again = read_study(after.text.encode(), PROTOCOLS)
    assert (again.document, again.faults) == (after.document, after.faults), "read anew"
    return after


def count_at(study: Study, path: Path) -> int:
    return len(value_at(study.document, path) or ())


def check(before: Study, request: Request, step: Step, after: Study) -> None:
    """Check what a request did to the document."""
    now = partial(value_at, after.document)
    match request:
        case SetValue(path, value):
            assert now(path) == (tuple(value) if isinstance(value, list) else value)
        case SetText(path, language, text):
            assert text in (now(path), (now((*path, language)) if isinstance(now(path), Mapping) else None))
        case RemoveKey(path):
            assert now(path) is None or now(path) != value_at(before.document, path)
        case AddKey(path):
            assert now(path) is not None
        case SwitchKind(path, kind):
            assert now((*path, "kind")) == kind
        case SwitchKey(path, to):
            assert (now(path), now((*path[:-1], to)) is not None) == (None, True)
        case AddEntry(path):
            assert count_at(after, path) == count_at(before, path) + 1
        case AddNamed(path, section):
            names = now(path)
            assert (names if isinstance(names, str) else names[-1]) in after.document[section]
        case AddElement(section):
            least = 2 if section == ("groups",) else 0  # a single group is a fault
            assert count_at(after, section) == max(least, count_at(before, section) + 1)
        case AddInstrument(name):
            assert name in {each.get("instrument") for each in after.document["questionnaires"].values()}
        case ChangeLanguage(how, code):
            assert how == "copy" or (code in languages_of(after.document)) == (how == "add")
            assert how != "copy" or code not in missing_texts(after)
        case DuplicateElement(path):
            assert count_at(after, path[:-1]) == count_at(before, path[:-1]) + 1
        case MakeSeries(path, field, values):
            added = count_at(after, path[:-1]) - count_at(before, path[:-1])
            assert (added, now((*step.select, *field[len(path) :])) in values) == (len(values), True)
        case MoveElement() | DeleteElement() | RenameElement():
            check_element(before, request, after)


def check_element(before: Study, request: Request, after: Study) -> None:
    path: Path = request.path  # type: ignore[attr-defined]
    old, new = (value_at(study.document, path[:-1]) for study in (before, after))
    match request:
        case MoveElement() if isinstance(old, tuple):
            assert old != new
            assert sorted(map(repr, old)) == sorted(map(repr, new))
        case DeleteElement(how=how):
            assert len(new or ()) == len(old) - 1
            if how != "gaps" and isinstance(path[-1], str):
                assert not references_to(after.document, path)
        case RenameElement(name=name):
            assert (new[path[-1]]["id"] == name) if isinstance(path[-1], int) else (name in new and path[-1] not in new)
            assert len(new) == len(old)


def outcome(study: Study, selected: Path, request: Request) -> Iterator[str]:
    """Check a request; yield the words of its step and the problems that it makes, or why it is refused."""
    try:
        step = request.step(StepContext(study, selected))
        after = edited(study, *step.edits, text=step.text)
    except StudyError as refusal:
        yield f"refused: {refusal}"
        return
    assert step.select is None or existing_path(after.document, step.select) == step.select, step.select
    check(study, request, step, after)
    yield f"{step.title}{step.fresh and f' ({step.fresh})'}{step.announcement and f': {step.announcement}'}"
    known = {fault.message for fault in study.faults}
    yield from (f"problem: {fault.message}" for fault in after.faults if fault.message not in known)


@pytest.mark.slow
@pytest.mark.parametrize("name", SMALL)
def test_each_command_has_its_stated_effect_and_undo_restores_the_text(name: str, pytestconfig: pytest.Config) -> None:
    ((_, study),) = studies((name,))
    kinds = set[str]()
    words = list[str]()
    for selected, request, place in every_request(study):
        kind = repr((type(request), place, getattr(request, "how", ""), getattr(request, "by", "")))
        if kind not in kinds:
            kinds.add(kind)
            try:
                words += outcome(study, selected, request)
            except AssertionError as wrong:
                raise AssertionError(f"{name} at {one_line(selected)}: {one_line(request)}: {wrong}") from wrong
    assert len(kinds) > 40
    if name == "sound":
        compare(GOLDEN / "commands.txt", each_once(words), pytestconfig)
