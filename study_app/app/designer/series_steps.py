"""Steps that make a series; where a study cannot take one, what helps: each is tried before it is offered.

Both are made in parts, so that the window can go on between them: a part is as long as one check of the study.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace
from textwrap import shorten
from typing import Final

from study_app.app.designer.element_steps import Step, beside
from study_app.authoring.changes.initial_values import counted_elements
from study_app.authoring.changes.series import (
    MOST,
    Member,
    first_edits,
    members,
    members_of,
    next_edits,
    number_row,
    problem_made,
    typed_values,
)
from study_app.authoring.edited_study import Study
from study_app.authoring.fields import Row
from study_app.authoring.names import references_to
from study_app.authoring.outline import title_of
from study_app.authoring.writer.edits import Edit, Set
from study_app.authoring.writer.refused import Refused
from study_app.number_text import counted, exact_text
from study_app.protocol.source.document import Path, value_at
from study_app.viewmodels.designer.prompts import SeriesPlan, SeriesWay, refused_plan
from study_app.viewmodels.designer.requests import MakeSeries

_NAMED: Final = 3
_TITLE: Final = 28
"""So many values, and so many letters of a title, the words of a button have."""


@dataclass(frozen=True)
class _Made:
    """A study to try edits on, before and with the elements of a series that are made so far."""

    before: Study
    now: Study
    row: Row
    edits: tuple[Edit, ...] = ()
    paths: tuple[Path, ...] = ()

    @property
    def original(self) -> Path:
        return self.row.path[:2]

    def with_next(self, member: Member) -> _Made:
        if not self.paths:
            edits, path = first_edits(self.now, self.original, self.row, member)
        else:
            previous = self.paths[-1]
            row = replace(self.row, path=(*previous, *self.row.path[2:]))
            edits, path = next_edits(self.now, previous, row, member)
            edits = beside(self.now, edits, previous, path)
        return replace(self._edited(edits), paths=(*self.paths, path))

    @property
    def lists(self) -> tuple[Path, ...]:
        """The lists of blocks that name the element."""
        places = references_to(self.before.document, self.original)
        listed = (place[:-1] for place in places if place[0] == "blocks" and isinstance(place[-1], int))
        return tuple(dict.fromkeys(listed))

    def listed(self, asked: MakeSeries) -> _Made:
        """Return the series with the lists that are to name nothing else, or none of its copies."""
        names = [path[1] for path in self.paths]
        others = ([one for one in value_at(self.now.document, path) if one not in names[1:]] for path in asked.kept)
        lists = {**dict.fromkeys(asked.only, names), **dict(zip(asked.kept, others, strict=True))}
        return self._edited([Set(path, value) for path, value in lists.items()])

    def _edited(self, edits: Sequence[Edit]) -> _Made:
        return replace(self, now=self.now.edited(*edits)[0], edits=(*self.edits, *edits))

    @property
    def problem(self) -> tuple[str, Path]:
        return problem_made(self.before, self.now, self.original, self.paths)


def series(study: Study, asked: MakeSeries) -> Step:
    """Return the step that makes an element the first of a series, and its copies right after it.

    Raises
    ------
    Refused
        Its values are not permitted, or it would cause a problem.
    """
    made = _begun(study, asked)
    for one in members(study, asked.path, made.row, asked.values):
        made = made.with_next(one)
    made = made.listed(asked)
    if words := made.problem[0]:
        raise _would_cause(words)
    count = counted_elements(len(made.paths), asked.path[0])
    said = ", ".join(title_of(made.now.document, one) for one in made.paths)
    words = f"Make {count} of {title_of(study.document, asked.path)}"
    return Step(words, made.edits, made.paths[0], several=made.paths, said=said)


def judged_series(study: Study, asked: MakeSeries) -> Generator[SeriesPlan | None, None, None]:
    """Check a series in parts: yield None after each, and the plan to show wherever there is more to say.

    None is shown of a series that can be made. Else the reason comes first, then the ways on.
    """
    try:
        begun = whole = _begun(study, asked)
    except Refused as refusal:
        yield refused_plan(refusal)
        return
    place: Path = ()
    try:
        for one in members(study, asked.path, begun.row, asked.values):
            whole = whole.with_next(one)
            yield None
        found, place = whole.problem
        if not found:
            return
        plan = refused_plan(_would_cause(found))
    except Refused as refusal:
        whole, plan = begun, refused_plan(refusal)
    yield plan
    left, first = yield from _leaving_out(study, asked, begun)
    plan = left or plan
    yield plan
    causes = tuple(path for path in begun.lists if path[:2] == (place or first)[:2])
    for words, meaning, in_lists in _OF_LISTS if whole.paths else ():
        for lists in filter(None, dict.fromkeys((causes, begun.lists))):
            asks = in_lists(asked, lists)
            if not whole.listed(asks).problem[0]:
                names = _blocks(study, lists)
                way = SeriesWay(words.format(*names), meaning.format(*names), asks)
                plan = replace(plan, ways=(*plan.ways, way))
                yield plan
                break
            yield None
    if causes and not left and not any(way.asks.kept == causes for way in plan.ways):
        left, _ = yield from _leaving_out(study, replace(asked, kept=causes), begun)
        yield left and replace(left, ways=(*left.ways, *plan.ways))


_OF_LISTS: Final[tuple[tuple[str, str, Callable[[MakeSeries, tuple[Path, ...]], MakeSeries]], ...]] = (
    (
        "List only these in {0}",
        "Makes the series, which replaces what is listed in {0}.",
        lambda asked, lists: replace(asked, only=lists),
    ),
    (
        "Leave {0} as {1}",
        "Makes the series without listing its copies in {0}.",
        lambda asked, lists: replace(asked, kept=lists),
    ),
)


def _begun(study: Study, asked: MakeSeries) -> _Made:
    trial = study.trial
    return _Made(trial, trial, number_row(study.document, asked.path, asked.field))


def _leaving_out(
    study: Study, asked: MakeSeries, begun: _Made
) -> Generator[SeriesPlan | None, None, tuple[SeriesPlan | None, Path]]:
    """Return a plan that names each value that would cause a problem, and leaves these out; None where too few stay.

    With it the place of the first problem is returned, () where there is none.
    """
    made, kept, left = begun, list[float](), list[str]()
    reasons: list[str] = []
    first: Path = ()
    try:
        typed = typed_values(study.document, begun.row, asked.values)
    except Refused:
        return None, first
    for value, why in typed:
        words = why or (f"a series has at most {MOST} values" if len(kept) == MOST else "")
        if not words:
            try:
                trial = made.with_next(members_of(study, asked.path, begun.row, [*kept, value])[-1])
                yield None
                words, place = trial.listed(asked).problem
                first = first or place
            except Refused as refusal:
                words = str(refusal)
            if not words:
                made = trial
                kept.append(value)
            else:
                words = f"{_shown([exact_text(value)], begun.row)}: {words}"
            yield None
        if words:
            left.append(f"one {exact_text(value)}" if value in kept else exact_text(value))
            reasons.append(words)
    if len(kept) < 2 or not left:
        return None, first
    values = " ".join(map(exact_text, kept))
    words, meaning = f"Leave out {_shown(left, begun.row)}", f"Makes a series of {values} {begun.row.unit}".rstrip()
    if asked.kept:
        title, they = _blocks(study, asked.kept)
        words, meaning = f"{words}, and leave {title} as {they}", f"{meaning}, without listing its copies in {title}"
    reason = "\n".join(refused_plan(Refused(words)).refusal for words in dict.fromkeys(reasons))
    return SeriesPlan(refusal=reason, ways=(SeriesWay(words, f"{meaning}.", replace(asked, values=values)),)), first


def _blocks(study: Study, lists: Sequence[Path]) -> tuple[str, str]:
    """Return which blocks lists are of, and the words for as they are."""
    title = shorten(title_of(study.document, lists[0][:2]), _TITLE, placeholder=" …")
    return (title, "it is") if len(lists) == 1 else (counted(len(lists), "block"), "they are")


def _shown(values: Sequence[str], row: Row) -> str:
    if len(values) > _NAMED:
        return counted(len(values), "value")
    return f"{', '.join(values)} {row.unit}".rstrip()


def _would_cause(words: str) -> Refused:
    return Refused(f"this series would cause a problem: {words}")
