"""How far a session went: read from its journal alone, so that it can be continued where it was left."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from study_app.errors import StoreError
from study_app.store.folders import locate
from study_app.store.journals import journal
from study_app.store.journals.journal import Line

_ROUNDED_S = 1.1e-6


@dataclass(frozen=True, slots=True)
class Given:
    """How a statement was answered so far; times on the session's clock [s], None where it did not happen yet."""

    onset_s: float | None = None
    first_s: float | None = None
    last_s: float | None = None
    changes: int = 0
    value: int | None = None


@dataclass(frozen=True, slots=True)
class Progress:
    """Where a session stands.

    ``start`` is its first line: participant, session, seed, language and the rest. ``step`` is the index in the
    schedule of the step to continue at: the first that was not left behind. ``page`` or ``trial`` names it where it was
    begun: of a trial, ``attempt`` counts how often it was presented, ``task_done`` says that the last time its task ran
    to the end (so only answers are missing, or, without a questionnaire, nothing), and ``answers`` holds what was
    chosen since. ``ended`` is the status of a finished session. ``t_s`` is the latest moment on its clock, ``language``
    the participant's.
    """

    start: Line
    step: int = 0
    page: str | None = None
    trial: int | None = None
    attempt: int = 0
    task_done: bool = False
    answers: dict[str, Given] = field(default_factory=dict)
    ended: str | None = None
    resumed: int = 0
    t_s: float = 0.0
    language: str = ""


def progress(session_folder: Path) -> Progress:
    """Return how far the session in ``session_folder`` went; a torn tail of its journal counts as never written.

    Raises
    ------
    StoreError
        It is no session's folder, or its journal is missing, empty or damaged.
    """
    _, session = locate(session_folder)
    return progress_of(journal.read(session.journal))


def progress_of(lines: Sequence[Line]) -> Progress:
    """Return how far a session went, from its journal's lines.

    Raises
    ------
    StoreError
        They do not begin as a session's do.
    """
    if not lines or lines[0]["event"] != "session_started":
        raise StoreError("the journal does not begin with session_started: nothing was begun that could go on")
    now = Progress(lines[0], language=lines[0].get("language", ""))
    for line in lines[1:]:
        now = _after(now, line)
    return replace(now, t_s=max(0.0, *(line["t_s"] for line in lines)))


def wrong_responses(lines: Sequence[Line]) -> Iterator[str]:
    """Yield a sentence on each answer in ``responses`` that is not the one given by the choices before it."""
    now = Progress(lines[0])
    for line in lines[1:]:
        if line["event"] == "responses":
            chosen = dict(now.answers)
            for row in line["items"]:
                given = chosen.pop(row["item"], Given())
                if not _is_of(row, given):
                    yield (
                        f"line {line['n']} (responses) has for {row['item']!r} in trial {line['trial']} another answer "
                        f"than was chosen before: it was changed"
                    )
            yield from (
                f"line {line['n']} (responses) lacks {item!r}, answered in trial {line['trial']}: it was changed"
                for item in chosen
            )
        now = _after(now, line)


def _is_of(row: Mapping[str, Any], given: Given) -> bool:
    """Return whether an answer in ``responses`` is what was ``given``; moments of a line are rounded to 1 µs."""
    moments = ((row[name], getattr(given, name)) for name in ("onset_s", "first_s", "last_s"))
    return (row["value"], row["changes"]) == (given.value, given.changes) and all(
        told == ours or (None not in (told, ours) and abs(told - ours) <= _ROUNDED_S) for told, ours in moments
    )


def _after(now: Progress, line: Line) -> Progress:
    match line["event"]:
        case "page_shown":
            return _at(now, page=line["page"])
        case "page_left":
            return _left(now)
        case "trial_started":
            return replace(_at(now, trial=line["trial"]), attempt=line["attempt"], task_done=False, answers={})
        case "trial_ended":
            return replace(now, task_done=line["outcome"] in ("complete", "timeout"))
        case "item_shown" | "choice":
            given = now.answers.get(line["item"], Given())
            return replace(now, answers={**now.answers, line["item"]: _answered(given, line)})
        case "responses":
            return _left(now)
        case "session_ended":
            return replace(now, ended=line["status"])
        case "language_chosen":
            return replace(now, language=line["language"])
        case "session_resumed":
            return replace(now, resumed=now.resumed + 1)
    return now


def _at(now: Progress, *, page: str | None = None, trial: int | None = None) -> Progress:
    """Enter a step, unless it is the one under way: then it is shown again."""
    if (now.page, now.trial) == (page, trial):
        return now
    now = now if (now.page, now.trial) == (None, None) else _left(now)
    return replace(now, page=page, trial=trial)


def _left(now: Progress) -> Progress:
    return replace(now, step=now.step + 1, page=None, trial=None, attempt=0, task_done=False, answers={})


def _answered(given: Given, line: Line) -> Given:
    at_s = line["t_s"]
    if line["event"] == "item_shown":
        return given if given.onset_s is not None else replace(given, onset_s=at_s)
    if given.first_s is None:
        return replace(given, first_s=at_s, last_s=at_s, value=line["value"])
    if given.value == line["value"]:
        return given
    return replace(given, last_s=at_s, value=line["value"], changes=given.changes + 1)


def attempts(lines: Iterable[Line]) -> list[tuple[int, int]]:
    """Return trial and attempt of every presentation, in order."""
    return [(line["trial"], line["attempt"]) for line in lines if line["event"] == "trial_started"]
