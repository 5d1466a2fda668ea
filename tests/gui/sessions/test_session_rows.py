"""The cells, chips and sentences about sessions and their trials, for values that all differ; no session is read."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from PySide6.QtCore import Qt

from study_app.gui.sessions import session_page
from study_app.gui.sessions.session_facts import (
    SessionFacts,
    answers_text,
    broken_limit_text,
    count_range_text,
    incidents_text,
    occurring_states,
    start_time_text,
    status_chip,
    validity_chip,
)
from study_app.gui.sessions.session_page import TrialRecord
from study_app.gui.sessions.sessions_table import _session_cell

NOW = datetime(2026, 3, 9, 18, 30, tzinfo=UTC)
FACTS = SessionFacts(
    participant="P7", session=2, study="oils", started=NOW.replace(hour=9, minute=0), status="completed", validity="valid",
    answers=12, answers_of=62, simulated=False, pilot=False, group="old",
    folder=Path("results/oils/data/sub-P7/ses-02"),
)  # fmt: skip
ROLES = Qt.ItemDataRole
pytestmark = pytest.mark.usefixtures("qapp")


@pytest.mark.parametrize(
    ("changes", "status", "validity"),
    [
        ({}, ("ok", "check", "Complete"), ("ok", "check", "Valid")),
        ({"status": "incomplete"}, ("warn", "warning", "Incomplete"), ("ok", "check", "Valid")),
        ({"status": "running"}, ("accent", "play", "Running"), ("neutral", "ring", "Open")),
        ({"status": "unfinished"}, ("warn", "clock", "Interrupted"), ("neutral", "ring", "Open")),
        ({"status": "withdrawn"}, ("neutral", "cross", "Withdrawn"), ("ok", "check", "Valid")),
        ({"status": "aborted"}, ("neutral", "cross", "Ended early"), ("ok", "check", "Valid")),
        ({"status": "broken"}, ("bad", "warning", "Fault"), ("ok", "check", "Valid")),
        ({"status": "damaged"}, ("bad", "warning", "Damaged"), ("neutral", "ring", "Open")),
        ({"validity": "invalid", "lost": 1}, ("ok", "check", "Complete"), ("warn", "warning", "Out of limits")),
        ({"validity": None}, ("ok", "check", "Complete"), ("neutral", "ring", "Open")),
        ({"lost": 2}, ("ok", "check", "Complete"), ("warn", "warning", "Recording lost")),
        ({"missing": "5 missing", "lost": 2}, ("ok", "check", "Complete"), ("warn", "warning", "Trials missing")),
        ({"excluded": "", "lost": 2}, ("ok", "check", "Complete"), ("neutral", "cross", "Excluded")),
    ],
)  # fmt: skip
def test_each_state_has_its_chips(changes: dict[str, Any], status: tuple[str, ...], validity: tuple[str, ...]) -> None:
    shown = replace(FACTS, **changes)
    assert (status_chip(shown), validity_chip(shown)) == (status, validity)


def test_each_cell_of_a_session_has_its_text_tip_and_line_below(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SessionFacts, "version", property(lambda facts: "1.2" if facts.session == 2 else ""))
    missing: Any = SimpleNamespace(brief="3 of 40 not delivered")
    shown = replace(FACTS, lost=2, reconnected=3, outlets_lost=1, excluded=None)
    incidents = "2 recordings lost, device reconnected 3 times, 1 outlet failed"
    told = f"P7, session 2: began Today 09:00, 12 of 62 answers, {incidents}"
    cells = {name: _session_cell(shown, name, NOW) for name in ("participant", "study", "started", "status", "answers")}
    assert {name: (cell[ROLES.DisplayRole], cell[ROLES.AccessibleTextRole]) for name, cell in cells.items()} == {
        "participant": ("P7, session 2", "P7, session 2, old"), "study": ("oils", "oils"),
        "started": ("Today 09:00", "Today 09:00"), "status": ("Complete", "Complete, device reconnected"),
        "answers": ("12 of 62", "12 of 62"),
    }  # fmt: skip
    assert {cell[ROLES.ToolTipRole] for cell in cells.values()} == {told}
    version = _session_cell(shown, "version", NOW)
    assert (version[ROLES.DisplayRole], version[ROLES.FontRole].underline()) == ("1.2", True)
    assert version[ROLES.ToolTipRole] == "Show what has changed in the study since version 1.2"
    assert _session_cell(replace(FACTS, session=1), "version", NOW)[ROLES.ToolTipRole].startswith("P7: began")
    out = _session_cell(replace(shown, excluded="spoke", missing=missing), "validity", NOW)
    assert out[ROLES.ToolTipRole] == "Excluded from the analysis: spoke"
    below = [_session_cell(replace(FACTS, **one), "status", NOW)[ROLES.AccessibleTextRole] for one in (
        {"missing": missing, "reconnected": 1}, {"outlets_lost": 1}, {},
    )]  # fmt: skip
    assert below == ["Complete, 3 of 40 not delivered", "Complete, outlet failed", "Complete"]
    sample = replace(FACTS, simulated=True, folder=Path("results/sample-x/data/sub-P7/ses-02"))
    kinds = [sample, replace(FACTS, simulated=True), replace(FACTS, simulated=True, pilot=True), FACTS]
    assert [_session_cell(one, "study", NOW)[ROLES.AccessibleTextRole] for one in kinds] == [
        "oils, sample", "oils, simulated", "oils, pilot", "oils",
    ]  # fmt: skip


def test_incidents_times_limits_and_states_are_put_in_words() -> None:
    assert [incidents_text(replace(FACTS, reconnected=number)) for number in (0, 1, 2)] == [
        "", "device reconnected", "device reconnected 2 times",
    ]  # fmt: skip
    assert [answers_text(replace(FACTS, answers_of=of)) for of in (62, None)] == ["12 of 62", "12"]
    starts = {
        "2026-03-09T01:02": "Today 01:02",
        "2026-03-08T23:59": "Yesterday 23:59",
        "2025-12-30T10:00": "30 Dec 2025 10:00",
    }
    assert [start_time_text(datetime.fromisoformat(f"{at}+00:00"), NOW) for at in starts] == [*starts.values()]
    assert broken_limit_text("worst_gap_ms", 31.25, 20) == "longest time between two ticks: 31.2 ms, limit 20 ms"
    assert broken_limit_text("withheld_share", 7.126, 5) == "proportion of the force held back: 7.13 %, limit 5 %"
    assert [count_range_text(numbers, "part") for numbers in ((1,), (2,), (1, 2))] == [
        "1 part",
        "2 parts",
        "1 to 2 parts",
    ]
    some = [replace(FACTS, status="aborted"), replace(FACTS, validity="invalid"), replace(FACTS, excluded="x", lost=1)]
    assert occurring_states(some) == [
        ("completed", "Complete"), ("aborted", "Ended early"), ("invalid", "Out of limits"), ("lost", "Recording lost"),
        ("excluded", "Excluded"),
    ]  # fmt: skip
    assert [replace(FACTS, status=status).is_counted for status in ("completed", "incomplete", "withdrawn")] == [
        True,
        True,
        False,
    ]
    assert not replace(FACTS, excluded="").is_counted


TRIAL = TrialRecord(
    number=3, attempt=2, words="Part 1, L2", outcome="timeout", valid=True, broken=(), answers=4,
    unconfirmed=("a: 5", "b: 6"), notes="marked", lost="it was full", excluded=None,
)  # fmt: skip


def test_each_cell_of_a_trial_has_its_own_text() -> None:
    headings = ("Trial", "Presented", "Ended", "Limits", "Answers", "Notes")
    cells = {heading: session_page._trial_cell(TRIAL, heading) for heading in headings}
    texts = [cells[heading][ROLES.DisplayRole] for heading in headings]
    assert texts == ["3", "Part 1, L2", "timeout", "Valid", "4 + 2?", "marked"]
    assert session_page._trial_cell(replace(TRIAL, unconfirmed=()), "Answers")[ROLES.DisplayRole] == "4"
    told = (
        " The recording was lost: it was full. These answers were chosen but not confirmed, so they are not in the "
        "tables: a: 5, b: 6."
    )
    assert {cell[ROLES.ToolTipRole] for cell in cells.values()} == {f"Trial 3: within all limits.{told}"}
    for changes, says, chip in (
        ({"valid": None}, "whether it met the limits is not known yet.", "Open"),
        ({"valid": False, "broken": ("late", "slow")}, "late; slow.", "Out of limits"),
        ({"excluded": "spoke"}, "excluded from the analysis (spoke); within all limits.", "Excluded"),
    ):
        shown = replace(TRIAL, lost="", unconfirmed=(), **changes)  # type: ignore[arg-type]
        assert session_page._trial_limits_text(shown) == f"Trial 3: {says}"
        assert session_page._trial_chip(shown)[2] == chip


def test_a_row_says_what_it_presented_and_choices_are_in_the_order_of_their_times() -> None:
    row = {"block": "b", "code": "L2", "part": 4, "phase": "main", "attempt": 1}
    said = [
        session_page._setting_text({**row, **changes}, codes)
        for changes, codes in (
            ({}, {}),
            ({"attempt": 3}, {"b": {"L2": "thick"}}),
            ({"part": None, "phase": "practice"}, {}),
        )
    ]
    assert said == ["Part 4, L2", "Part 4, L2: thick, attempt 3", "Practice, L2"]
    given: Any = {
        item: SimpleNamespace(value=value, first_s=first_s)
        for item, value, first_s in (("late", 5, 9.0), ("early", None, 2.0), ("first", 1, None))
    }
    assert session_page._choice_texts(given) == ("first: 1", "early: cannot judge", "late: 5")
