"""Orders made again from a receipt, and compared with those that were run: a proof that needs no key.

The receipt holds the protocol without its conditions, and that is all an order is made of besides seed and participant.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from study_app.protocol.orders.block_orders import orders_of_receipt
from study_app.protocol.orders.schedule import Trial, build_schedule

_TOLD = ("block", "phase", "part", "index", "of", "code")


@dataclass(frozen=True, slots=True)
class RecordedTrial:
    """One attempt at a trial as a session recorded it; ``items`` in the order shown, None if nothing was answered.

    ``may_hide`` says that answers may have hidden some of the items, which are then not recorded.
    """

    number: int
    block: str
    phase: str
    part: int | None
    index: int
    of: int
    code: str
    items: tuple[str, ...] | None = None
    may_hide: bool = False


def recorded_trials(lines: Iterable[Mapping[str, Any]]) -> tuple[RecordedTrial | int, ...]:
    """Return what the lines of a journal say was presented: every attempt, in the order of time.

    A trial that was passed over is its number alone.

    Raises
    ------
    KeyError
        A line lacks what lines of its event hold, or answers a trial that never started.
    """
    attempts: list[RecordedTrial | int] = []
    place: dict[tuple[int, int], int] = {}
    for line in lines:
        if line["event"] == "trial_started":
            place[line["trial"], line["attempt"]] = len(attempts)
            attempts.append(RecordedTrial(line["trial"], *(line[name] for name in _TOLD)))
        elif line["event"] == "responses":
            rows = sorted(line["items"], key=lambda row: int(row["number"]))
            index = place[line["trial"], line["attempt"]]
            attempt = attempts[index]
            assert isinstance(attempt, RecordedTrial)  # noqa: S101 - only these have a place
            items, may_hide = tuple(row["item"] for row in rows), any("kind" in row for row in rows)
            attempts[index] = replace(attempt, items=items, may_hide=may_hide)
        elif line["event"] == "passed_over" and "trial" in line:
            attempts.append(line["trial"])
    return tuple(attempts)


def reproduce(
    protocol: Mapping[str, Any],
    seed: int,
    participant: str,
    recorded: Iterable[RecordedTrial | int],
    *,
    complete: bool,
    group: str | None = None,
    session: int = 1,
    row_of: str | None = None,
) -> tuple[str, ...]:
    """Return how the trials that were run differ from those that receipt, seed and participant give.

    Parameters
    ----------
    protocol : mapping
        The protocol as the receipt holds it: without conditions, blocks with their codes.
    seed : int
        The session's seed, from its receipt.
    participant : str
        The participant's id.
    recorded : iterable of RecordedTrial or int
        What was run, in the order of time; of trials that were passed over their numbers.
    complete : bool
        Whether the session went to its end, so that no trial may be missing.
    group : str, optional
        The participant's group in a study with groups.
    session : int
        The session's number.
    row_of : str, optional
        The id whose rows of squares the session took; None: the participant's own.

    Raises
    ------
    StudyError
        The receipt's protocol does not state the orders.
    """
    orders = orders_of_receipt(protocol, group=group, session=session)
    planned = {trial.number: trial for trial in build_schedule(orders, participant, seed, row_of).trials}
    attempts = tuple(recorded)
    found = [
        sentence
        for trial in attempts
        if isinstance(trial, RecordedTrial)
        for sentence in _against(planned.get(trial.number), trial)
    ]
    numbers = [trial if isinstance(trial, int) else trial.number for trial in attempts]
    blocks = protocol["study"].get("resume") == "block"
    found += _progress(numbers, planned, complete=complete, blocks=blocks)
    return tuple(dict.fromkeys(found))


def _against(planned: Trial | None, run: RecordedTrial) -> Iterator[str]:
    """Yield how one recorded trial differs from the planned one of its number."""
    if planned is None:
        yield f"trial {run.number}: recorded, but the seed gives no such trial"
        return
    for name in _TOLD:
        ours, theirs = getattr(planned, name), getattr(run, name)
        if ours != theirs:
            yield f"trial {run.number}: {name} {_named(theirs)} recorded, the seed gives {_named(ours)}"
    if run.items is None:
        return
    expected = tuple(item for item in planned.items if item in run.items) if run.may_hide else planned.items
    if run.items != expected:
        yield f"trial {run.number}: items {_listed(run.items)} recorded, the seed gives {_listed(planned.items)}"


def _progress(numbers: list[int], planned: dict[int, Trial], *, complete: bool, blocks: bool) -> Iterator[str]:
    """Yield where the trials did not come one after the other, each attempt after the one before.

    With ``blocks`` a resumed session presents the block again that it was within, from its first trial.
    """
    before = 0
    first = {trial.block: number for number, trial in reversed(planned.items())}
    for number in numbers:
        due = {before, before + 1}
        again = {first[planned[one].block] for one in due & planned.keys()} if blocks else set()
        if number not in due | again:
            after = f"after trial {before}" if before else "first"
            yield f"trial {number}: came {after}, where trial {before + 1} was due"
        before = number
    last = len(planned)
    if complete and before < last:
        missing = f"trial {last} was" if before + 1 == last else f"trials {before + 1} to {last} were"
        yield f"{missing} not recorded, though the session is complete"


def _named(value: object) -> str:
    return "none" if value is None else str(value)


def _listed(items: tuple[str, ...]) -> str:
    return ", ".join(items) if items else "none"
