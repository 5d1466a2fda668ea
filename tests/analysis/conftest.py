"""Results folders with known answers: real key, receipts and columns, rows made up by the test."""

import random
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from study_app.protocol.load import load, parse
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Trial, build_schedule
from study_app.store import receipt
from study_app.store.blinded import blinding
from study_app.store.blinded.blinding import Key
from study_app.store.exclusions import Exclusion, exclusion_bytes, exclusions
from study_app.store.files.columns import RESPONSES, TRIALS
from study_app.store.files.csv_files import Column, csv_bytes
from study_app.store.files.folders import SessionFolder, StudyFolder

SMALL = (Path(__file__).parent / "small.toml").read_text(encoding="utf-8")
"""A study with repetitions, an optional item, an answer off the scale and questions in practice."""
SAMPLE = StudyFolder(Path(__file__).resolve().parents[2] / "results" / "sample-rek2024")
"""Rehearsed, and shipped sealed."""
CANNOT_JUDGE = "cannot judge"
DELAY_ERROR_MS = 3.5

Answer = int | str | None
"""1 to 7, CANNOT_JUDGE, or None: left unanswered."""


@dataclass
class Results:
    """A study folder that tests fill session by session."""

    folder: Path
    protocol: Protocol
    key: Key
    simulated: bool

    def add(
        self,
        participant: str,
        answer: Callable[[str, str], Answer],
        *,
        session: int = 1,
        status: str = "completed",
        repeated: dict[str, Callable[[str, str], Answer]] | None = None,
        trials: int | None = None,
        changes: dict[str, Any] | None = None,
    ) -> SessionFolder:
        """Write a session in which ``answer(condition, item)`` was answered.

        ``repeated`` maps codes to what was answered in a first attempt, ``trials`` ends the session after so many,
        ``changes`` replaces cells of every trial's row.
        """
        schedule = build_schedule(self.protocol, participant, seed=session)
        responses: list[dict[str, Any]] = []
        presented: list[dict[str, Any]] = []
        for trial in schedule.trials[:trials]:
            attempts = [(repeated or {})[trial.code]] if trial.code in (repeated or {}) else []
            for attempt, attempt_answer in enumerate([*attempts, answer], start=1):
                place = self._place(participant, session, trial, attempt)
                presented.append({**_blank(TRIALS), **place, "of": trial.of, **(changes or {})})
                condition = self.key.condition(trial.block, trial.code)
                responses += [
                    {**_blank(RESPONSES), **place, **_answered(attempt_answer(condition, item), item, number)}
                    for number, item in enumerate(trial.items, start=1)
                ]
        folder = StudyFolder(self.folder).session(participant, session)
        folder.path.mkdir(parents=True)
        folder.table(self.protocol.study.name, "responses").write_bytes(csv_bytes(RESPONSES, responses))
        folder.table(self.protocol.study.name, "trials").write_bytes(csv_bytes(TRIALS, presented))
        receipt.write(folder.receipt, self._receipt(participant, session, status))
        return folder

    def responses(self, participant: str, session: int = 1) -> Path:
        """Return the responses of a session."""
        return StudyFolder(self.folder).session(participant, session).table(self.protocol.study.name, "responses")

    def trials(self, participant: str, session: int = 1) -> Path:
        """Return the trials of a session."""
        return StudyFolder(self.folder).session(participant, session).table(self.protocol.study.name, "trials")

    def exclude(self, participant: str, *, session: int = 1, trial: int | None = None, reason: str = "tired") -> None:
        """Exclude a session, or one trial of it, from the analysis."""
        new = Exclusion(
            participant=participant,
            session=session,
            trial=trial,
            rule_or_person="AB",
            reason=reason,
            excluded_at="2026-01-06T10:00:00.000+01:00",
        )
        all_exclusions = (*exclusions(self.folder), new)
        StudyFolder(self.folder).exclusions.write_bytes(exclusion_bytes(all_exclusions))

    def trial(self, participant: str, condition: str, *, session: int = 1) -> int:
        """Return the number of the first trial in which a condition was presented."""
        trials = build_schedule(self.protocol, participant, seed=session).trials
        return next(trial.number for trial in trials if self.key.condition(trial.block, trial.code) == condition)

    def open(self) -> None:
        """Open the key."""
        blinding.reveal(self.folder, by="AB", reason="collection closed")

    def code(self, condition: str, block: str) -> str:
        """Return the code of a condition."""
        return next(code for code, code_condition in self.key.codes[block].items() if code_condition == condition)

    def _place(self, participant: str, session: int, trial: Trial, attempt: int) -> dict[str, Any]:
        return {
            "study": self.protocol.study.name,
            "participant": participant,
            "session": session,
            "simulated": self.simulated,
            "pilot": False,
            "trial": trial.number,
            "attempt": attempt,
            "block": trial.block,
            "phase": trial.phase,
            "part": trial.part,
            "index": trial.index,
            "code": trial.code,
        }

    def _receipt(self, participant: str, session: int, status: str) -> dict[str, Any]:
        return {
            "format": 1,
            "status": status,
            "reason": "",
            "started_at": "2026-01-05T10:00:00.000+01:00",
            "ended_at": None,
            "participant": participant,
            "session": session,
            "study": self.protocol.study.name,
            "language": "en",
            "simulated": self.simulated,
            "pilot": False,
            "key_hash": self.key.hash,
            "device": {"name": "scripted"},
            "protocol": receipt.without_conditions(self.protocol),
        }


def _answered(given: Answer, item: str, number: int) -> dict[str, Any]:
    touched = given is not None
    return {
        "form": None,
        "after_block": None,
        "item": item,
        "kind": "statement",
        "number": number,
        "response": str(given) if isinstance(given, int) else None,
        "value": given if isinstance(given, int) else None,
        "cannot_judge": given == CANNOT_JUDGE,
        "first_choice_s": 12.25 if touched else None,
        "last_change_s": 12.5 if touched else None,
    }


def _blank(columns: tuple[Column, ...]) -> dict[str, Any]:
    """Return a row in which every cell holds something its column permits."""
    row: dict[str, Any] = {}
    for column in columns:
        values = {"text": "x", "integer": 1, "number": 0.5, "flag": False, "time": "2026-01-05T10:00:00.000+01:00"}
        row[column.name] = column.levels[0][0] if column.levels else values[column.kind]
    known = {"delay_error_mean_ms": DELAY_ERROR_MS, "valid": True}
    return row | {name: value for name, value in known.items() if name in row}


def make_results(folder: Path, protocol: Protocol, *, simulated: bool = True, key_seed: int = 3) -> Results:
    """Return an empty study folder with its sealed key, drawn from a fixed seed."""
    folder.mkdir()
    key = blinding.open_or_draw_key(folder, protocol, random.Random(key_seed).random)  # noqa: S311 - reproducible
    return Results(folder, protocol, key, simulated)


@pytest.fixture
def rek(tmp_path: Path) -> Results:
    """The thesis' study without any session."""
    return make_results(tmp_path / "rek2024", load("rek2024"))


@pytest.fixture
def small(tmp_path: Path) -> Results:
    """A study with repetitions, an optional item, an answer off the scale and questions in practice."""
    return make_results(tmp_path / "small", parse(SMALL.encode(), "small.toml"))


@pytest.fixture
def real(tmp_path: Path) -> Results:
    """The thesis' study with real participants."""
    return make_results(tmp_path / "rek2024", load("rek2024"), simulated=False)


def twelve(results: Results, *, people: int = 12) -> Results:
    """Fill the thesis' study with plausible answers, the same at every call."""
    likely = {"water": 5, "honey": 4, "light_oil": 6}
    for number in range(1, people + 1):
        draw = random.Random(number)  # noqa: S311 - reproducible

        def answer(condition: str, item: str, draw: random.Random = draw) -> int:
            if condition.startswith("delay_"):
                level = 1.6 + 4.2 * (int(condition.removeprefix("delay_")) / 200) ** 1.3
                level = 8 - level if item == "comfortable" else level
            else:
                level = likely[condition]
                if item.startswith("like_"):
                    level = 6 if item == f"like_{condition}" else 2 + len(item + condition) % 3
            return max(1, min(7, round(draw.gauss(level, 1.0))))

        results.add(f"P{number:03d}", answer)
    return results


HIDDEN = ("zembla", "quorn", "1013.7", "877.3")
"""What the small study hides: its liquids' and conditions' names (any case) and densities."""


@pytest.fixture
def png_figures_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Write figures only as PNG, the format that the page embeds; the same code draws every other format again."""
    from study_app.analysis.report import write_report

    monkeypatch.setattr(write_report, "FORMATS", ("png",))
