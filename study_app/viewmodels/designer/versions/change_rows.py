"""Differences from a version, sorted by what they do to the data."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from study_app.authoring.edited_study import Study
from study_app.authoring.fields import label_of
from study_app.authoring.outline import title_of
from study_app.authoring.versions.changes import Change, Effect
from study_app.protocol.source.document import entries
from study_app.protocol.wording.languages import language_name
from study_app.viewmodels.designer.problem_rows import element_of
from study_app.viewmodels.tones import Tone

EFFECTS: Final[tuple[tuple[Effect, Tone, str, str, str], ...]] = (
    ("tables", "bad", "cross", "Breaks tables", "answers before and after do not fit into one table"),
    ("measured", "warn", "warning", "Changes what is measured", "answers before and after are not comparable"),
    ("comparable", "ok", "check", "Keeps answers comparable", "answers before and after can be analysed together"),
)
"""Each effect with tone, icon, heading and meaning; the one with the most consequences first."""


@dataclass(frozen=True, slots=True)
class ChangeRow:
    """One difference.

    Attributes
    ----------
    change : Change
        What differs, and the edits that revert it.
    element : tuple of str or int
        The element of the outline that it belongs to; () where it belongs to none.
    title : str
        Element and field in words.
    """

    change: Change
    element: tuple[str | int, ...]
    title: str


@dataclass(frozen=True, slots=True)
class ChangeGroup:
    """The differences of one effect: its tone, icon, heading and meaning."""

    tone: Tone
    icon: str
    title: str
    meaning: str
    rows: tuple[ChangeRow, ...]


def change_groups(found: Iterable[Change], study: Study) -> tuple[ChangeGroup, ...]:
    """Return differences by their effect, in the order of `EFFECTS`; an effect without any is left out."""
    rows = [_row(change, study) for change in found]
    groups = (
        ChangeGroup(tone, icon, title, meaning, tuple(row for row in rows if row.change.effect == effect))
        for effect, tone, icon, title, meaning in EFFECTS
    )
    return tuple(group for group in groups if group.rows)


def _row(change: Change, study: Study) -> ChangeRow:
    place = change.path or tuple(change.sentence.partition(":")[0].split("."))
    element = element_of(study, place)
    languages = {code for _, code in entries(study.document, "study.languages.*")}
    fields = [
        language_name(step) if step in languages and isinstance(step, str) else label_of(step)
        for step in place[len(element) :]
    ]
    gone = element == place[:1] and len(place) > 1 and place[:1] != ("study",) and isinstance(place[1], str)
    name = label_of(place[0]) if gone else title_of(study.document, element)
    there = bool(change.path) and place[0] in study.document
    return ChangeRow(change, element if there else (), ", ".join([name, *fields]))
