"""The cells, chips and sentences about sessions and their trials: calls and their results; no session is read.

People change ``rows.txt``; no option regenerates it.
"""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from PySide6.QtCore import Qt

from study_app.gui.sessions import session_facts, session_page
from study_app.gui.sessions.session_facts import SessionFacts
from study_app.gui.sessions.session_page import TrialRecord
from study_app.gui.sessions.sessions_table import _session_cell
from tests.golden import check_kept
from tests.transcripts import calls, played

NOW = datetime(2026, 3, 9, 18, 30, tzinfo=UTC)
FACTS = SessionFacts(
    participant="P7", session=2, study="oils", started=NOW.replace(hour=9, minute=0), status="completed",
    validity="valid", answers=12, answers_of=62, simulated=False, pilot=False, group="old",
    folder=Path("results/oils/data/sub-P7/ses-02"),
)  # fmt: skip
TRIAL = TrialRecord(
    number=3, attempt=2, words="Part 1, L2", outcome="timeout", valid=True, broken=(), answers=4,
    unconfirmed=("a: 5", "b: 6"), notes="marked", lost="it was full", excluded=None,
)  # fmt: skip
TEXTS = Qt.ItemDataRole.DisplayRole, Qt.ItemDataRole.AccessibleTextRole, Qt.ItemDataRole.ToolTipRole


class Missing(SimpleNamespace):
    """Missing trials with a brief and a long text."""

    def __str__(self) -> str:
        return str(self.long)


def facts(**changes: Any) -> SessionFacts:
    return replace(FACTS, **changes)


def cell(row: Any, *headings: str) -> list[tuple[str, ...]]:
    """Return text, spoken text and tip of the cells under headings."""
    cells = (
        _session_cell(row, heading, NOW) if isinstance(row, SessionFacts) else session_page._trial_cell(row, heading)
        for heading in headings
    )
    return [tuple(dict.fromkeys(str(data[role]) for role in TEXTS)) for data in cells]


def setting(codes: list[Any], **changes: Any) -> str:
    row = {"block": "b", "code": "L2", "part": 4, "phase": "main", "attempt": 1} | changes
    return session_page._setting_text(row, {"b": dict([codes])} if codes else {})


def choices(*answer_rows: Any) -> tuple[str, ...]:
    answers: Any = {item: SimpleNamespace(value=value, first_s=first_s) for item, value, first_s in answer_rows}
    return session_page._choice_texts(answers)


NAMES = {
    **{name: getattr(session_facts, name) for name in (
        "status_chip", "validity_chip", "incidents_text", "answers_text", "broken_limit_text", "count_range_text",
        "occurring_states",
    )},
    "facts": facts, "trial": lambda **changes: replace(TRIAL, **changes), "cell": cell, "setting": setting,
    "choices": choices, "chip": session_page._trial_chip, "counted": lambda row: row.is_counted,
    "began": lambda at: session_facts.start_time_text(datetime.fromisoformat(f"{at}+00:00"), NOW),
    "in_folder": lambda folder, **changes: facts(folder=Path(f"results/{folder}/data/sub-P7/ses-02"), **changes),
    "MISSING": Missing(brief="3 of 40 not delivered", long="3 trials of 40"),
}  # fmt: skip


@pytest.mark.usefixtures("qapp")
def test_each_call_has_its_words(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SessionFacts, "version", property(lambda row: "1.2" if row.session == 2 else ""))
    file = Path(__file__).with_name("rows.txt")
    check_kept(file, played(file, calls(NAMES)))
