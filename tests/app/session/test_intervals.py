"""A session of pairs in windows without a screen, attended by keys alone."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from study_app import app
from study_app.gui.participant.window import ParticipantWindow
from study_app.session.pages import ChoicePage, FeedbackPage, TaskPage
from tests.app.people import Person, events, rows, window
from tests.compiled import needs_servo
from tests.protocol.trials.studies import BLOCK, HEAD

pytestmark = [pytest.mark.slow, needs_servo, pytest.mark.usefixtures("qapp", "nobody_stays", "quick_preflight")]

EDITS = (
    ("levels = [0.2, 0.4, 0.8]\nrepetitions = 8", "levels = [0.4]\nrepetitions = 2"),
    ("standards = [1, 2]", "standards = [1]"),
    ("min_s = 1\nmax_s = 3", "min_s = 0.2\nmax_s = 0.5"),
    ('design = "2ifc"', 'design = "pairs"'),
    ("[limits]", "[limits]\n" + "\n".join(f"{one} = 1000" for one in ("lateness_ms", "worst_gap_ms", "frame_gap_ms"))),
    (
        "level_error_percent = 100",
        "level_error_percent = 100\ndelay_error_ms = 1000",
    ),  # a busy computer repeats nothing
)
PAIRS = '\n[designs.pairs]\nkind = "2ifc"\nfeedback = "always"\n'
ANSWERS = (Qt.Key.Key_2, Qt.Key.Key_Left)


class Attentive(Person):
    """Answers by keys, and keeps which tanks and signs of feedback were seen."""

    def __init__(self) -> None:
        super().__init__()
        self.tanks: list[tuple[int, object]] = []
        self.signs: list[bool] = []

    def look(self) -> None:
        participant = window(ParticipantWindow)
        page = None if participant is None else participant.page
        if isinstance(page, TaskPage):
            assert page.interval is not None
            self.tanks.append((page.trial, participant.tank))
            if page.interval.resting:
                QTest.keyClick(participant, Qt.Key.Key_Space)  # ends no rest
        elif isinstance(page, ChoicePage) and page is not self.answered:
            self.answered = page
            QTest.keyClick(participant.focusWidget(), ANSWERS[page.trial - 1])
        elif isinstance(page, FeedbackPage):
            self.signs.append(page.right)
        else:
            super().look()


def test_a_session_of_pairs_is_attended_by_keys_alone(tmp_path: Path) -> None:
    text = HEAD + BLOCK + PAIRS
    for old, new in EDITS:
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "levels.toml").write_text(text)
    results = tmp_path / "results" / "levels"
    person = Attentive()
    code = app.run(
        str(tmp_path / "levels.toml"),
        participant="P001",
        seed=5,
        device="scripted",
        windowed=True,
        operator="AK",
        results=results,
        tell=lambda _line: None,
    )
    tanks = {trial: {id(tank) for one, tank in person.tanks if one == trial} for trial, _ in person.tanks}
    person.deleteLater()
    assert code == 0
    assert [row["response"] for row in rows(results, "responses")][-2:] == ["second", "first"]
    told = events(results)
    assert told[-1]["status"] == "completed"
    intervals = [row for row in rows(results, "intervals") if row["outcome"] == "complete"]
    assert [row["interval"] for row in intervals] == ["1", "2", "1", "2"]
    assert all(float(row["gap_s"]) >= 0.6 for row in intervals if row["gap_s"] != "n/a")
    assert {trial: len(seen) for trial, seen in tanks.items()} == {1: 1, 2: 1}
    assert person.signs
    ended = [event["t_s"] for event in told if event["event"] == "trial_ended"]
    shown = [event["t_s"] for event in told if event["event"] == "item_shown"]
    assert all(item - end < 1.0 for end, item in zip(ended, shown, strict=True))
