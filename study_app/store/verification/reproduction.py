"""A session's orders and levels made again and compared with its journal.

Orders follow from the receipt; the key stays sealed, but for the group in a study with groups. Levels are opened with
the key, in memory alone, and compared with those that follow from the answers before them, these taken at the levels
presented, so that a difference does not propagate. No level is printed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from study_app.errors import StoreError
from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import orders_of_receipt
from study_app.protocol.orders.durations import own_protocol
from study_app.protocol.orders.schedule import Schedule, build_schedule, recorded_trials, reproduce
from study_app.protocol.streams import Key, group_of
from study_app.protocol.trials.presentation import arrangement_text, heard_in, next_level
from study_app.protocol.trials.tracks import adjusting_of, design_of
from study_app.store import receipt
from study_app.store.blinded.blinding import opened, read_key, whole_protocol
from study_app.store.folders import StudyFolder, locate
from study_app.store.journals import journal
from study_app.store.journals.journal import Line


@dataclass(slots=True)
class Reproduced:
    """What was compared."""

    differences: list[str] = field(default_factory=list)
    followed: list[str] = field(default_factory=list)


def reproduced(session_folder: Path) -> Reproduced:
    """Return how a session compares with what its receipt, the study's key and its answers give.

    Raises
    ------
    StoreError
        It is not a session folder, or its receipt or journal cannot be read.
    """
    study, folder = locate(session_folder)
    ran, lines = receipt.read(folder.receipt), journal.read(folder.journal)
    try:
        complete = ran["status"] == "completed"
        recorded = recorded_trials(lines)
        differences = reproduce(
            ran["protocol"],
            ran["seed"],
            ran["participant"],
            recorded,
            complete=complete,
            group=_group(study, lines),
            session=ran["session"],
            row_of=ran.get("row_of"),
        )
    except (KeyError, TypeError) as error:
        raise StoreError(f"{folder.path}: receipt or journal lack {error}: verify the study's folder") from error
    found = Reproduced([*differences])
    if lines and lines[0].get("intervals"):
        _levels(study, ran, lines, found)
    return found


def _levels(study: StudyFolder, ran: Mapping[str, Any], lines: list[Line], found: Reproduced) -> None:
    """Compare what each trial of intervals presented with what was due."""
    try:
        key = read_key(study.path)
        lines = opened(lines, key)
    except StoreError as error:
        found.differences.append(f"levels cannot be compared: {error}")
        return
    if key.hash != ran["key_hash"]:
        found.differences.append("levels cannot be compared: the key is not the one that the session ran under")
        return
    try:
        protocol = own_protocol(whole_protocol(ran["protocol"], key), _group(study, lines), ran["session"])
        orders = orders_of_receipt(ran["protocol"], group=_group(study, lines), session=ran["session"])
        schedule = build_schedule(orders, ran["participant"], ran["seed"], ran.get("row_of"))
        compared = _Compared(protocol, Key(key.codes, key.nonce), schedule)
        for index, line in enumerate(lines):
            compared.take(line, lines[:index])
    except (KeyError, TypeError, AttributeError, ValueError, StopIteration):  # the reason could reveal a level
        found.differences.append("levels cannot be compared: receipt, key and journal do not give the levels")
        return
    found.differences += compared.differences
    for block, trials in compared.trials.items():
        follows = sum(trials.values())
        found.followed.append(f"{block}: {follows} of {len(trials)} levels follow from the answers")


class _Compared:
    """Trials of intervals, compared one after the other; ``trials`` says by block and number whether they follow."""

    def __init__(self, protocol: Protocol, key: Key, schedule: Schedule) -> None:
        self.differences: list[str] = []
        self.trials: dict[str, dict[int, bool]] = {}
        self._protocol = protocol
        self._key = key
        self._schedule = schedule
        self._planned = {trial.number: trial for trial in self._schedule.trials}

    def take(self, line: Line, before: Sequence[Line]) -> None:
        """Compare one line with what follows from those before it."""
        if line["event"] in {"interval_ended", "responses"}:
            self._take_setting(line, before)
        if line["event"] not in {"trial_started", "passed_over"} or line.get("trial") not in self._planned:
            return
        trial = self._planned[line["trial"]]
        block = self._protocol.blocks[trial.block]
        if block.design is None:
            return
        heard = heard_in(self._protocol, before)
        due = next_level(self._protocol, self._key, self._schedule, trial, heard)
        if line["event"] == "passed_over":
            if due is not None:
                self.differences.append(f"trial {trial.number}: passed over, though it was due by the answers")
            return
        presented = (line["level"], line["standard"], line["arrangement"], line.get("catch", False))
        follows = due is not None and presented == (
            due.level,
            due.standard,
            arrangement_text(design_of(self._protocol, block), due.arrangement),
            due.catch,
        )
        if not follows:
            what = (
                "presented, though it was to be passed over" if due is None else "another level or arrangement was due"
            )
            self.differences.append(f"trial {trial.number}, attempt {line['attempt']}: {what}")
        self._note(block, trial.number, follows)

    def _take_setting(self, line: Line, before: Sequence[Line]) -> None:
        """Compare the level that a participant set with the steps from where it started, and the answer with their sum.

        A line that is not about a setting is left alone.
        """
        if line["event"] == "interval_ended" and line.get("setting") is None:
            return
        which = line["trial"], line["attempt"]
        own = [one for one in before if (one.get("trial"), one.get("attempt")) == which]
        started = next(one for one in own if one["event"] == "trial_started")
        block = self._protocol.blocks[started["block"]]
        setting = adjusting_of(self._protocol, block, started["standard"], started["level"]) if block.stimulus else None
        if setting is None:
            return
        steps = [one["steps"] for one in own if one["event"] == "stepped"]
        if line["event"] == "responses":
            follows = line["items"][0]["value"] == sum(steps)
        else:
            follows = line["setting"] == setting.level(setting.reached(steps))
        if not follows:
            self.differences.append(f"trial {which[0]}, attempt {which[1]}: its steps lead to another setting")
        self._note(block, which[0], follows)

    def _note(self, block: Block, trial: int, follows: bool) -> None:
        of_block = self.trials.setdefault(block.id, {})
        of_block[trial] = follows and of_block.get(trial, True)


def _group(study: StudyFolder, lines: list[Line]) -> str | None:
    """Return the group that the participant's entry gives, None in a study without groups."""
    if "entry" not in lines[0]:
        return None
    key = read_key(study.path)
    return group_of(key.groups, key.nonce, lines[0]["entry"])
