"""Every command of the designer on every kind of place, compared with reviewed texts: words, edits, faults."""

from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path as File
from typing import Any

import pytest

from study_app.designer.document.additions import number_rows
from study_app.designer.document.fields import Row, row_at, rows
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
    Situation,
    SwitchKey,
    SwitchKind,
)
from study_app.designer.document.study import Study, read_study
from study_app.designer.outline import addable_elements
from study_app.errors import StudyError
from study_app.protocol.source.document import Path, entries
from tests.designer.document.grown import PROTOCOLS
from tests.golden import compare
from tests.golden_values import changed, one_line
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
            lists = (one for one in rows(document, path) if one.kind == "list" and isinstance(one.value, tuple))
            yield from ((*one.path, at) for one in lists for at in range(len(one.value)))


def of_row(row: Row, document: Mapping[str, Any]) -> Iterator[Request]:
    """Yield what a row of a form can ask for."""
    path, value = row.path, row.value
    if value is not None:
        yield RemoveKey(path)
    elif row.kind != "kind":
        yield AddKey(path)
    if row.kind in OTHER and value is not None:
        yield SetValue(path, next((one.value for one in row.choices if one.value != value), OTHER[row.kind]))
    if row.kind == "kind":
        yield from (SwitchKind(path[:-1], one.value) for one in row.choices if one.value != value)
    if row.kind == "either":
        yield from (SetValue(path, one.default) for one in row.either if one.default not in (None, value))
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
    """Yield what can be done with an element."""
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
    others = [one for one, _ in entries(document, f"{path[0]}.*") if one[1] != path[1]]
    if others and len(path) == 2:
        other = str(others[0][1])
        yield DeleteElement(path, "other", other)
        yield RenameElement(path, other)


def of_study(study: Study) -> Iterator[Request]:
    yield from (ChangeLanguage(how, code) for how, code in (("add", "de"), ("remove", "nl"), ("copy", "nl")))


def generic(path: Path) -> Path:
    """Return a path without its names: each kind of place is asked once."""
    return tuple(
        "*" if (at == 1 and len(path) > 1 and path[0] not in TABLES) or isinstance(step, int) else step
        for at, step in enumerate(path)
    )


def asked(study: Study) -> Iterator[tuple[Path, Request, Any]]:
    """Yield each request with the element that is selected, and the place that it is about.

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
        for one in addable_elements(study, path):
            place = (*generic(path)[:1], one.words.partition(" of ")[0])
            if isinstance(one.asks, AddElement | AddInstrument) and not added.issuperset(place):
                added.update(place)
                yield path, one.asks, place


def kind_of(study: Study, request: Request, place: Path, *, coarse: bool) -> Any:
    """Return what tells requests apart: the place, or coarsely how it is edited."""
    path = getattr(request, "path", ())
    row = row_at(study.document, path) if coarse and path else None
    where = ((len(place) > 2, row.kind, row.value is None) if row else place[-1:]) if coarse else place
    names = ("kind", "how", "by", "section", "language", "to") if not coarse else ("how", "by", "language")
    return type(request), where, [getattr(request, name, None) for name in names]


def said(study: Study, selected: Path, request: Request) -> Iterator[str]:
    """Yield what a step says and changes, or why it is refused."""
    try:
        step = request.step(Situation(study, selected))
        before = study.with_text(step.text)[0] if step.text else study
        after, _ = before.with_edits(*step.edits)
    except StudyError as refusal:
        yield f"refused: {refusal}"
        return
    yield f"{step.words}; select {one_line(step.select)}{step.fresh and f', {step.fresh}'}; {step.said}"
    yield from changed(study.text.split("\n"), after.text.split("\n"), numbered=True)
    known = {(fault.path, fault.message) for fault in study.faults}
    yield from (f"! {one_line(one.path)} {one.message}" for one in after.faults if (one.path, one.message) not in known)


@cache
def kinds(name: str, *, coarse: bool) -> tuple[tuple[Path, Request, str], ...]:
    """Return each request in a study with the element that is selected, and what tells its kind."""
    ((_, study),) = studies((name,))
    found = asked(study)
    return tuple((path, one, repr(kind_of(study, one, place, coarse=coarse))) for path, one, place in found)


def transcript(before: Iterable[str], names: Iterable[str], *, coarse: bool) -> Iterator[str]:
    """Yield what each kind of request does in some studies that is none of the studies before."""
    seen = {kind for name in before for *_, kind in kinds(name, coarse=coarse)}
    for name, study in studies(names):
        for selected, request, kind in kinds(name, coarse=coarse):
            if kind not in seen:
                seen.add(kind)
                yield f"== {name} at {one_line(selected)}: {one_line(request)}"
                yield from said(study, selected, request)


def test_each_command_on_each_kind_of_value(pytestconfig: pytest.Config) -> None:
    compare(GOLDEN / "commands.txt", transcript((), SMALL[:1], coarse=True), pytestconfig)


@pytest.mark.slow
@pytest.mark.parametrize("name", SMALL)
def test_each_command_at_each_place(name: str, pytestconfig: pytest.Config) -> None:
    found = transcript(SMALL[: SMALL.index(name)], (name,), coarse=False)
    compare(GOLDEN / f"commands_in_{name}.txt", found, pytestconfig)
