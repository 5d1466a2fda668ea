"""How far a session has come, told by its journal: the operator sees what is on disk, never more.

``SessionProgress`` is folded over the journal's events in the order in which they were written. No Qt here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import PageStep, Schedule, Trial
from study_app.store.tables.columns import SEALED
from study_app.store.tables.session_tables import beyond_limits

# A block of more trials than this is one row of the rail ("Delay settings 1 to 7"), so that a day's study fits it.
ROWS_PER_BLOCK = 4

Beyond: TypeAlias = tuple[str, float, float]


@dataclass(frozen=True, slots=True)
class NoteLine:
    """A note or mark as the operator wrote it, ``at_s`` in the time that was worked."""

    at_s: float
    kind: str
    text: str


@dataclass(frozen=True, slots=True)
class SessionProgress:
    """What the journal of a session of ``protocol`` says so far.

    ``step`` indexes the schedule's steps (−1 before the first); ``durations_s`` holds the steps left behind; ``away_s``
    is how long no program held the session, which no duration counts; ``answers`` counts the answered items of each
    trial, ``targets`` those reached in the trial under way or answered, ``trials_done`` says of each trial what was
    measured in it that broke the protocol's limits: column, value and limit, in a double-blind study of lateness and
    gaps alone, ``lost`` why a trial's recording could not be kept, ``lacking`` how many samples it lacks where it does.
    """

    protocol: Protocol
    schedule: Schedule
    step: int = -1
    step_since_s: float = 0.0
    durations_s: Mapping[int, float] = field(default_factory=dict)
    trial_since_s: float | None = None
    trial_lasted_s: float | None = None
    targets: int = 0
    trials_done: Mapping[int, tuple[Beyond, ...]] = field(default_factory=dict)
    answers: Mapping[int, int] = field(default_factory=dict)
    lost: Mapping[int, str] = field(default_factory=dict)
    lacking: Mapping[int, int] = field(default_factory=dict)
    notes: tuple[NoteLine, ...] = ()
    repeats: int = 0
    paused: bool = False
    force_off: bool = False
    broke: str = ""
    ended: str = ""
    ended_s: float = 0.0
    fingerprint: str = ""
    saved_s: float | None = None
    away_s: float = 0.0

    @property
    def trial(self) -> Trial | None:
        """The trial under way or being answered; None on a page of text and before the first step."""
        if self.step < 0:
            return None
        step = self.schedule.steps[self.step]
        return step if isinstance(step, Trial) else None

    @property
    def marks(self) -> int:
        """How many marks were set."""
        return sum(note.kind == "mark" for note in self.notes)

    @property
    def trials_within_limits(self) -> int:
        """How many finished trials kept the protocol's limits, as far as the operator may know."""
        return sum(not beyond for beyond in self.trials_done.values())

    @property
    def main_trials(self) -> tuple[tuple[int, int], ...]:
        """Of each part: how many of its main trials were left behind, and how many it has."""
        counts: dict[int | None, tuple[int, int]] = {}
        for index, step in enumerate(self.schedule.steps):
            if isinstance(step, Trial) and step.phase == "main":
                done, of = counts.get(step.part, (0, 0))
                counts[step.part] = (done + (index < self.step or self.ended == "completed"), of + 1)
        return tuple(counts.values())

    def after(self, event: str, at_s: float, fields: Mapping[str, Any]) -> SessionProgress:
        """Return the progress once ``event`` is on disk; events that say nothing about progress only count as saved."""
        told = _TELLERS.get(event)
        progress = told(self, at_s, fields) if told else self
        return replace(progress, saved_s=at_s)


def _enter(progress: SessionProgress, at_s: float, step: int) -> SessionProgress:
    if step == progress.step:
        return progress
    durations = dict(progress.durations_s)
    if progress.step >= 0:
        durations[progress.step] = at_s - progress.step_since_s
    return replace(progress, step=step, step_since_s=at_s, durations_s=durations)


def _page_shown(progress: SessionProgress, at_s: float, fields: Mapping[str, Any]) -> SessionProgress:
    for index in range(max(progress.step, 0), len(progress.schedule.steps)):
        step = progress.schedule.steps[index]
        if isinstance(step, PageStep) and step.page_id == fields["page"]:
            return replace(_enter(progress, at_s, index), trial_since_s=None, trial_lasted_s=None)
    return progress


def _trial_started(progress: SessionProgress, at_s: float, fields: Mapping[str, Any]) -> SessionProgress:
    steps = progress.schedule.steps
    number = fields["trial"]
    index = next(i for i, step in enumerate(steps) if isinstance(step, Trial) and step.number == number)
    return replace(
        _enter(_without(progress, number), at_s, index),
        trial_since_s=at_s,
        trial_lasted_s=None,
        targets=0,
        paused=False,
    )


def _without(progress: SessionProgress, number: int) -> SessionProgress:
    """Forget what an earlier attempt of a trial left."""
    return replace(
        progress,
        answers={trial: count for trial, count in progress.answers.items() if trial != number},
        trials_done={trial: beyond for trial, beyond in progress.trials_done.items() if trial != number},
    )


def _trial_ended(progress: SessionProgress, at_s: float, fields: Mapping[str, Any]) -> SessionProgress:
    lasted = at_s - progress.trial_since_s if progress.trial_since_s is not None else None
    progress = replace(progress, trial_lasted_s=lasted)
    if fields["outcome"] not in {"complete", "timeout"}:
        return progress
    beyond = beyond_limits(fields, progress.protocol.limits.model_dump())
    if progress.protocol.study.blinding == "double":
        beyond = tuple(one for one in beyond if one[0] not in SEALED)
    return replace(progress, trials_done={**progress.trials_done, fields["trial"]: beyond})


def _recorded(progress: SessionProgress, _at_s: float, fields: Mapping[str, Any]) -> SessionProgress:
    count = fields["samples_unrecorded"]
    return replace(progress, lacking={**progress.lacking, fields["trial"]: count}) if count else progress


def _responses(progress: SessionProgress, _at_s: float, fields: Mapping[str, Any]) -> SessionProgress:
    return replace(progress, answers={**progress.answers, fields["trial"]: len(fields["items"])})


def _note(progress: SessionProgress, at_s: float, fields: Mapping[str, Any]) -> SessionProgress:
    note = NoteLine(at_s - progress.away_s, fields["kind"], fields["text"])
    return replace(progress, notes=(*progress.notes, note))


def _repeat(progress: SessionProgress, _at_s: float, fields: Mapping[str, Any]) -> SessionProgress:
    return replace(_without(progress, fields["trial"]), repeats=progress.repeats + 1)


def _resumed(progress: SessionProgress, at_s: float, _fields: Mapping[str, Any]) -> SessionProgress:
    """Go on after a gap, which the session's clock counts and nobody worked in."""
    gap_s = 0.0 if progress.saved_s is None else max(0.0, at_s - progress.saved_s)
    return replace(
        progress,
        paused=False,
        force_off=False,
        broke="",
        trial_since_s=None,
        trial_lasted_s=None,
        step_since_s=progress.step_since_s + gap_s,
        away_s=progress.away_s + gap_s,
    )


def _ended(progress: SessionProgress, at_s: float, fields: Mapping[str, Any]) -> SessionProgress:
    durations = dict(progress.durations_s)
    if progress.step >= 0:
        durations[progress.step] = at_s - progress.step_since_s
    ended = replace(progress, ended=fields["status"], ended_s=at_s, paused=False, durations_s=durations)
    return replace(ended, fingerprint=fields.get("fingerprint", ""))


_TELLERS = {
    "page_shown": _page_shown,
    "trial_started": _trial_started,
    "target_reached": lambda progress, _at_s, _fields: replace(progress, targets=progress.targets + 1),
    "trial_ended": _trial_ended,
    "responses": _responses,
    "recording_lost": lambda progress, _at_s, fields: replace(
        progress, lost={**progress.lost, fields["trial"]: fields["reason"]}
    ),
    "recorded": _recorded,
    "paused": lambda progress, _at_s, _fields: replace(progress, paused=True),
    "resumed": lambda progress, _at_s, _fields: replace(progress, paused=False),
    "force_stopped": lambda progress, _at_s, _fields: replace(progress, force_off=True),
    "force_restored": lambda progress, _at_s, _fields: replace(progress, force_off=False),
    "note": _note,
    "repeat": _repeat,
    "broke": lambda progress, _at_s, fields: replace(progress, broke=str(fields["what"])),
    "device_reconnected": lambda progress, _at_s, _fields: replace(progress, broke="", force_off=True),
    "session_resumed": _resumed,
    "session_ended": _ended,
}


def progress_after(progress: SessionProgress, lines: Iterable[Mapping[str, Any]]) -> SessionProgress:
    """Return the progress once the lines of a journal are on disk."""
    for line in lines:
        progress = progress.after(line["event"], line["t_s"], line)
    return progress


@dataclass(frozen=True, slots=True)
class Stage:
    """One row of the rail: the schedule's steps ``first`` to ``last`` under one neutral ``label``."""

    label: str
    first: int
    last: int


def operator_language(protocol: Protocol) -> str:
    """Return the language in which the operator reads a study's own texts: English, or the study's first."""
    return "en" if "en" in protocol.study.languages else protocol.study.languages[0]


def stages(protocol: Protocol, schedule: Schedule) -> tuple[Stage, ...]:
    """Return the rows of the rail: pages and settings one by one, longer blocks as one row."""
    language = operator_language(protocol)
    rows: list[Stage] = []
    index = 0
    while index < len(schedule.steps):
        step = schedule.steps[index]
        if isinstance(step, PageStep):
            rows.append(Stage(protocol.text(protocol.pages[step.page_id].title, language), index, index))
            index += 1
            continue
        last = index
        while last + 1 < len(schedule.steps) and _same_block(step, schedule.steps[last + 1]):
            last += 1
        rows.extend(_block_rows(protocol, schedule, index, last, language))
        index = last + 1
    return tuple(rows)


def _same_block(trial: Trial, other: PageStep | Trial) -> bool:
    return isinstance(other, Trial) and other.block == trial.block


def _block_rows(protocol: Protocol, schedule: Schedule, first: int, last: int, language: str) -> list[Stage]:
    trials = [step for step in schedule.steps[first : last + 1] if isinstance(step, Trial)]
    if len(trials) <= ROWS_PER_BLOCK:
        return [Stage(trial.label(protocol, language), first + i, first + i) for i, trial in enumerate(trials)]
    label = protocol.text(protocol.blocks[trials[0].block].setting_label, language)
    return [Stage(f"{label} {trials[0].index} to {trials[-1].index}", first, last)]
