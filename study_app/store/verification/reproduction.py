"""Reproduction of a session's orders and levels, and comparison with its journal.

The session's protocol is composed from the receipt and the key, which is opened only in memory. Each presented level is
compared with the one that follows from the earlier answers at their presented levels, so that a difference does not
propagate. No level is printed.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from study_app.errors import StoreError
from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.orders import RecordedTrial, Schedule, build_schedule, reproduce
from study_app.protocol.presented import next_level
from study_app.protocol.randomization import Key
from study_app.protocol.trials import LEVEL_RULES
from study_app.store import receipt
from study_app.store.blinded import blinding
from study_app.store.blinded.blinding import complete_protocol, open_events, participant_group, place_number, read_key
from study_app.store.files.folders import locate_session
from study_app.store.journals import journal
from study_app.store.journals import journal_events as events
from study_app.store.session_progress.progress import trial_results


@dataclass(slots=True)
class Reproduction:
    """The result of reproducing a session's orders and levels."""

    differences: list[str] = field(default_factory=list)
    followed: list[str] = field(default_factory=list)


def reproduce_session(session_folder: Path) -> Reproduction:
    """Compare a session with the orders and levels computed from its receipt, the study's key and its answers.

    Raises
    ------
    StoreError
        It is not a session folder, or its receipt or journal, or the study's key, cannot be read.
    """
    study, folder = locate_session(session_folder)
    session_receipt, lines, key = receipt.read(folder.receipt), journal.read(folder.journal), read_key(study.path)
    if key.hash != session_receipt["key_hash"]:
        raise StoreError(f"{study.key} is not the key for session {folder.path}: restore it from a backup")
    if missing := [name for name in receipt.FIELDS if name not in session_receipt]:
        raise StoreError(f"{folder.receipt} does not contain {', '.join(missing)}: restore it from a backup")
    seed, participant = session_receipt["seed"], session_receipt["participant"]
    complete = session_receipt["status"] in events.REACHED_END
    try:
        start = events.start_of(lines)
        protocol = complete_protocol(session_receipt["protocol"], key).for_session(
            participant_group(start, key), session_receipt["session"]
        )
        place = place_number(replace(start, row_of=session_receipt.get("row_of")), key)
        schedule = build_schedule(protocol, participant, seed, place)
        recorded = recorded_trials(open_events(lines, key) if lines and events.start_of(lines).own_codes else lines)
    except (KeyError, TypeError, AttributeError, ValueError):  # the reason could reveal a condition
        raise StoreError(
            f"the receipt, the key and the journal of {folder.path} do not fully describe the session: verify the "
            "study's folder"
        ) from None
    reproduction = Reproduction([*reproduce(protocol, seed, participant, recorded, complete=complete, place=place)])
    if lines and events.start_of(lines).intervals:
        comparison = _LevelComparison(protocol, Key(key.codes, key.nonce), schedule)
        _compare_levels(comparison, lines, key, reproduction)
        versions = session_receipt["versions"]  # here receipts of 0.2.1 may have the rules as a text
        if comparison.differences and str(session_receipt.get("level_rules", versions.get("level rules"))) != str(
            LEVEL_RULES
        ):
            reproduction.followed.append(
                f"the session was run by liquid-study {versions.get('liquid-study')}, which chose levels by different "
                "rules: run reproduce with that version"
            )
    return reproduction


def _compare_levels(
    comparison: "_LevelComparison", lines: list[events.Event], key: blinding.Key, reproduction: Reproduction
) -> None:
    """Compare the levels presented in trials of intervals with the computed ones."""
    try:
        lines = open_events(lines, key)
        for index, line in enumerate(lines):
            comparison.compare_line(line, lines[:index])
    except StoreError as error:
        reproduction.differences.append(f"levels cannot be compared: {error}")
        return
    except (KeyError, TypeError, AttributeError, ValueError, StopIteration):  # the reason could reveal a level
        reproduction.differences.append(
            "levels cannot be compared: the receipt, the key and the journal do not contain the levels"
        )
        return
    reproduction.differences += comparison.differences
    for block, trials in comparison.trials.items():
        follows = sum(trials.values())
        reproduction.followed.append(f"{block}: {follows} of {len(trials)} levels are consistent with the answers")


class _LevelComparison:
    """Compare trials of intervals in order; ``trials`` maps block and number to whether the levels agree."""

    def __init__(self, protocol: Protocol, key: Key, schedule: Schedule) -> None:
        self.differences: list[str] = []
        self.trials: dict[str, dict[int, bool]] = {}
        self._protocol = protocol
        self._key = key
        self._schedule = schedule
        self._planned = {trial.number: trial for trial in self._schedule.trials}

    def compare_line(self, line: events.Event, before: Sequence[events.Event]) -> None:
        """Compare one line with the level that follows from the lines before it."""
        if isinstance(line, events.IntervalEnded | events.Responses):
            self._compare_setting(line, before)
        if not isinstance(line, events.TrialStarted | events.PassedOver) or line.trial not in self._planned:
            return
        trial = self._planned[line.trial]
        block = self._protocol.blocks[trial.block]
        if block.design is None:
            return
        due = next_level(self._protocol, self._key, self._schedule, trial, trial_results(self._protocol, before))
        if isinstance(line, events.PassedOver):
            if due is not None:
                self.differences.append(f"trial {trial.number} was skipped, although the answers required it")
            return
        presented = (line.level, line.standard, line.arrangement, bool(line.catch))
        follows = due is not None and presented == (
            due.level,
            due.standard,
            self._protocol.design_of(block).arrangement_text(due.arrangement),
            due.catch,
        )
        if not follows:
            problem = (
                "it was presented, although it should have been skipped"
                if due is None
                else "the answers require a different level or arrangement"
            )
            self.differences.append(f"trial {trial.number}, attempt {line.attempt}: {problem}")
        self._record(block, trial.number, follows)

    def _compare_setting(self, line: events.IntervalEnded | events.Responses, before: Sequence[events.Event]) -> None:
        """Compare a level set by the participant with its start plus its steps, and the answer with the steps' sum.

        Lines that do not belong to a setting are ignored.
        """
        set_to = line.others.get("setting")
        if isinstance(line, events.IntervalEnded) and set_to is None:
            return
        attempt_key = line.trial, line.attempt
        attempt_events = [
            event
            for event in before
            if isinstance(event, events.OfAttempt) and (event.trial, event.attempt) == attempt_key
        ]
        started = next(event for event in attempt_events if isinstance(event, events.TrialStarted))
        block = self._protocol.blocks[started.block]
        if block.stimulus is None or started.level is None:
            return
        setting = self._protocol.adjusting(block, started.standard, started.level)
        if setting is None:
            return
        steps = [event.steps for event in attempt_events if isinstance(event, events.Stepped)]
        if isinstance(line, events.Responses):
            follows, problem = (
                bool(line.items) and line.items[0].value == sum(steps),
                "the answer is not the sum of the",
            )
        else:
            follows = set_to == setting.level(setting.place_after(steps))
            problem = "the setting at the end of the interval does not match the"
        if not follows:
            self.differences.append(f"trial {attempt_key[0]}, attempt {attempt_key[1]}: {problem} steps")
        self._record(block, attempt_key[0], follows)

    def _record(self, block: Block, trial: int, follows: bool) -> None:
        agreement = self.trials.setdefault(block.id, {})
        agreement[trial] = follows and agreement.get(trial, True)


def recorded_trials(lines: Iterable[events.Event]) -> tuple[RecordedTrial | int, ...]:
    """Return every attempt at a trial in a journal's lines in chronological order.

    For a skipped trial only its number is returned. Raise KeyError if a line answers a trial that never started.
    """
    attempts: list[RecordedTrial | int] = []
    started: dict[tuple[int, int], tuple[int, RecordedTrial]] = {}
    for line in lines:
        if isinstance(line, events.TrialStarted):
            trial = RecordedTrial(
                number=line.trial,
                block=line.block,
                phase=line.phase,
                part=line.part,
                index=line.index,
                of=line.of,
                code=line.code,
            )
            started[line.trial, line.attempt] = len(attempts), trial
            attempts.append(trial)
        elif isinstance(line, events.Responses):
            rows = sorted(line.items, key=lambda row: row.number)
            index, trial = started[line.trial, line.attempt]
            items, may_hide = tuple(row.item for row in rows), any(row.kind is not None for row in rows)
            attempts[index] = replace(trial, items=items, may_hide=may_hide)
        elif isinstance(line, events.PassedOver) and line.trial is not None:
            attempts.append(line.trial)
    return tuple(attempts)
