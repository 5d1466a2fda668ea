"""Sessions of pairs and of settings in windows without a screen, attended by keys alone."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from study_app.gui.operator.window import OperatorWindow
from study_app.gui.participant.window import ParticipantWindow
from study_app.session.pages import ChoicePage, EndPage, FeedbackPage, TaskPage
from study_app.session.replay import replay
from study_app.store.verification.reproduction import reproduce_session
from tests.app.people import Person, events, rows, run_attended, window
from tests.compiled import needs_servo
from tests.protocol.trials.level_studies import BLOCK, HEAD

pytestmark = [pytest.mark.slow, needs_servo, pytest.mark.usefixtures("qapp", "nobody_stays", "quick_preflight")]

EDITS = (
    ("levels = [0.2, 0.4, 0.8]\nrepetitions = 8", "levels = [0.4]\nrepetitions = 2"),
    ("standards = [1, 2]", "standards = [1]"),
    ("min_s = 1\nmax_s = 3", "min_s = 0.2\nmax_s = 0.5"),
    ('design = "2ifc"', 'design = "pairs"'),
    (
        "[limits]",
        "[limits]\n" + "\n".join(f"{limit} = 1000" for limit in ("lateness_ms", "worst_gap_ms", "frame_gap_ms")),
    ),
    (
        "level_error_percent = 100",
        "level_error_percent = 100\ndelay_error_ms = 1000",
    ),  # a busy computer repeats nothing
)
PAIRS = '\n[designs.pairs]\nkind = "2ifc"\nfeedback = "always"\n'
ANSWERS = (Qt.Key.Key_2, Qt.Key.Key_Left)


class Attentive(Person):
    """A person who answers by keys, and records the shown tanks and feedback signs."""

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


def write_edited_study(folder: Path, text: str, edits: tuple[tuple[str, str], ...]) -> Path:
    """Write a study, with such edits of its text."""
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    (folder / "levels.toml").write_text(text, encoding="utf-8", newline="\n")
    return folder / "levels.toml"


def test_a_session_of_pairs_is_completed_by_keys_alone(tmp_path: Path) -> None:
    results = tmp_path / "results" / "levels"
    person = Attentive()
    code, _ = run_attended(write_edited_study(tmp_path, HEAD + BLOCK + PAIRS, EDITS), results, person)
    tanks = {trial: {id(tank) for of_trial, tank in person.tanks if of_trial == trial} for trial, _ in person.tanks}
    assert code == 0
    assert [row["response"] for row in rows(results, "responses")][-2:] == ["second", "first"]
    journal = events(results)
    assert journal[-1]["status"] == "completed"
    # A computer that is late makes an attempt invalid; its trial comes again.
    whole = [event for event in journal if event["event"] == "trial_ended" and event["outcome"] == "complete"]
    last = {(str(event["trial"]), str(event["attempt"])) for event in whole}
    intervals = [row for row in rows(results, "intervals") if (row["trial"], row["attempt"]) in last]
    assert [(row["interval"], row["outcome"]) for row in intervals] == 2 * [("1", "complete"), ("2", "complete")]
    assert all(float(row["gap_s"]) >= 0.6 for row in intervals if row["gap_s"] != "n/a")
    assert {trial: len(tank_ids) for trial, tank_ids in tanks.items()} == {1: 1, 2: 1}
    assert person.signs
    ended = [event["t_s"] for event in whole]
    item_times_s = [event["t_s"] for event in journal if event["event"] == "item_shown"]
    assert all(item - end < 1.0 for end, item in zip(ended, item_times_s, strict=True))


SETTING = """
[stimuli.around]
condition = "oil"
vary = "viscosity_pa_s"
level = "value"
levels = [0.5, 2]

[methods.set]
kind = "adjustment"
repetitions = 2

[blocks.viscosity]
part = 1
title = "Viscosity"
setting_label = "Setting"
code_prefix = "V"
task = "stir"
stimulus = "around"
design = "adjustment"
method = "set"
"""
STEPS = (Qt.Key.Key_Right, Qt.Key.Key_Right, Qt.Key.Key_Left, Qt.Key.Key_Right)


class Adjusting(Person):
    """A person who adjusts by keys, then confirms until the next page."""

    def __init__(self) -> None:
        super().__init__()
        self.page: TaskPage | None = None
        self.looks = 0

    def look(self) -> None:
        participant = window(ParticipantWindow)
        page = None if participant is None else participant.page
        if not isinstance(page, TaskPage):
            if not isinstance(page, EndPage) or window(OperatorWindow) is not None:  # closed already
                super().look()
        elif page.adjusts and participant.tank.view is not None:
            self.looks = 0 if page is not self.page else self.looks + 1
            self.page = page
            QTest.keyClick(participant, STEPS[self.looks] if self.looks < len(STEPS) else Qt.Key.Key_Return)
        else:
            QTest.keyClick(participant, Qt.Key.Key_Right)  # nothing is set yet


@pytest.mark.nightly
def test_levels_are_set_by_keys_alone(tmp_path: Path) -> None:
    results = tmp_path / "results" / "levels"
    code, _ = run_attended(write_edited_study(tmp_path, HEAD + SETTING, (EDITS[2], *EDITS[4:])), results, Adjusting())
    assert code == 0
    journal = events(results)
    assert journal[-1]["status"] == "completed"
    last = {line["trial"]: line["attempt"] for line in journal if line["event"] == "trial_started"}
    last_attempts = [
        line for line in journal if line.get("attempt") == last.get(line.get("trial"), 0)
    ]  # a pause may repeat one
    steps_made = [(line["trial"], line["steps"]) for line in last_attempts if line["event"] == "stepped"]
    assert steps_made == [(trial, steps) for trial in (1, 2) for steps in (1, 1, -1, 1)]
    assert len({line["scene"] for line in journal if line["event"] == "stepped"}) >= 8
    assert [row["response"] for row in rows(results, "responses")] == ["2", "2"]
    assert [line["interval"] for line in last_attempts if line["event"] == "interval_ended"] == [1, 2, 1, 2]
    session = next((results / "data").glob("sub-*/ses-*"))
    assert reproduce_session(session).differences == []
    assert replay(session).differences == ()
