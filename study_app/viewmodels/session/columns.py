"""What the columns of a table of sessions are, which chips stand in them, and how sessions are filtered. No Qt here."""

from collections.abc import Callable, Iterable
from typing import Literal, NamedTuple, TypeAlias

from study_app.number_text import counted
from study_app.viewmodels.sessions import SessionFacts

Name: TypeAlias = Literal["participant", "study", "started", "status", "validity", "answers", "version"]
Tone: TypeAlias = Literal["ok", "warn", "bad", "accent", "neutral"]
Chipped: TypeAlias = tuple[Tone, str, str]
"""Tone, icon and word of a chip."""

STATUS: dict[str, Chipped] = {
    "completed": ("ok", "check", "Complete"),
    "running": ("accent", "play", "Running"),
    "unfinished": ("warn", "clock", "Interrupted"),
    "withdrawn": ("neutral", "cross", "Withdrawn"),
    "aborted": ("neutral", "cross", "Ended early"),
    "broken": ("bad", "warning", "Fault"),
    "damaged": ("bad", "warning", "Damaged"),
}
VALIDITY: dict[str | None, Chipped] = {
    "valid": ("ok", "check", "Valid"),
    "invalid": ("warn", "warning", "Out of limits"),
    None: ("neutral", "ring", "Open"),
}
LOST: Chipped = ("warn", "warning", "Recording lost")


class Column(NamedTuple):
    """What a column holds, its heading, and its share of the width; at least ``least`` px of it."""

    name: Name
    heading: str
    width: int
    least: int


def status_chip(facts: SessionFacts) -> Chipped:
    """Return what the chip says of how a session ended."""
    return STATUS.get(facts.status, ("neutral", "ring", facts.status.capitalize()))


def validity_chip(facts: SessionFacts) -> Chipped:
    """Return what the chip says of a session's limits and recordings, or that it does not count at all."""
    if facts.excluded is not None:
        return "neutral", "cross", "Excluded"
    if facts.lost and facts.validity != "invalid":
        return LOST
    return VALIDITY[None if facts.needs_care or facts.status == "running" else facts.validity]


def incidents(facts: SessionFacts) -> str:
    """Return what happened to device, recordings and outlets: "2 recordings lost, device reconnected", or nothing."""
    lost = f"{counted(facts.lost, 'recording')} lost" if facts.lost else ""
    times = "" if facts.reconnected == 1 else f" {facts.reconnected} times"
    outlets = f"{counted(facts.outlets_lost, 'outlet')} failed" if facts.outlets_lost else ""
    return ", ".join(filter(None, (lost, f"device reconnected{times}" if facts.reconnected else "", outlets)))


def answers_words(facts: SessionFacts) -> str:
    """Return "12 of 62", or "12" where the whole is not known."""
    return f"{facts.answers} of {facts.answers_of}" if facts.answers_of is not None else str(facts.answers)


def matching(words: str, status: str) -> Callable[[SessionFacts], bool]:
    """Return whether a session's participant holds ``words`` and its state is ``status`` ("" for any).

    ``status`` is one of `STATUS`, "excluded", "invalid" or "lost".
    """
    wanted = words.strip().lower()

    def matches(facts: SessionFacts) -> bool:
        if wanted not in facts.participant.lower():
            return False
        if status == "excluded":
            return facts.excluded is not None
        if status == "lost":
            return facts.lost > 0
        return status in {"", facts.status} or (status == "invalid" and facts.validity == "invalid")

    return matches


def states_of(found: Iterable[SessionFacts]) -> list[tuple[str, str]]:
    """Return the states that occur among sessions, with their words, in the order of `STATUS`."""
    there = list(found)
    states = [(status, word) for status, (_, _, word) in STATUS.items() if any(one.status == status for one in there)]
    if any(one.validity == "invalid" for one in there):
        states.append(("invalid", VALIDITY["invalid"][2]))
    if any(one.lost for one in there):
        states.append(("lost", LOST[2]))
    if any(one.excluded is not None for one in there):
        states.append(("excluded", "Excluded"))
    return states
