"""The dialogs of the results page: their texts, and the choices and texts that they return."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtWidgets import QLabel, QWidget

from study_app.gui.kit.dialogs import REASON, Question
from study_app.gui.results.dialogs import Extra, LeaveOutDialog, WriteDialog, take_back_question, unblind_question
from study_app.gui.sessions.session_facts import SessionFacts
from study_app.gui.theme.theme import LIGHT
from study_app.store.exclusions import Exclusion

pytestmark = pytest.mark.slow
NO_NAME = "Please enter a name. It will be recorded."


def session(participant: str, number: int) -> SessionFacts:
    return SessionFacts(
        participant=participant, session=number, study="oils", started=datetime(2026, 3, 9, tzinfo=UTC),
        status="completed", validity="valid", answers=8, answers_of=8, simulated=False, pilot=False, folder=Path("x"),
    )  # fmt: skip


def exclusion(trial: int | None, by: str, at: str = "2026-03-09T12:00:00+00:00") -> Exclusion:
    return Exclusion(
        participant="P007", session=2, trial=trial, rule_or_person=by, reason="slept", excluded_at=at
    )  # fmt: skip


def confirm_question(qtbot: Any, question: Question) -> tuple[str, str, str, list[str]]:
    """Return title, explanation, button and further texts of a question; check that its fields are required."""
    qtbot.addWidget(question)
    question.show()
    title = question.windowTitle()
    texts = [label.text() for label in question.findChildren(QLabel) if label.isVisible() and label.text()]
    assert title in texts
    for name, sentence, value in (("by", NO_NAME, "AK"), ("reason", REASON, "slept")):
        question.accept()
        assert (question.missing.text(), question.missing.isVisible(), question.isVisible()) == (sentence, True, True)
        question.editors[name].show_value(value)
    with qtbot.waitSignal(question.accepted):
        question.go_on.click()
    return title, question.said.text(), question.go_on.text(), texts


def test_unblinding_states_its_consequences_and_how_many_sessions_are_incomplete(qtbot: Any) -> None:
    parent = QWidget()
    qtbot.addWidget(parent)
    for count, begins in ((0, ""), (1, "1 session is not complete."), (3, "3 sessions are not complete.")):
        title, explanation, button, texts = confirm_question(qtbot, unblind_question(parent, LIGHT, "oils", count))
        assert (title, button) == ("Unblind oils?", "Unblind")
        assert explanation.startswith("Everyone who opens this study will see which condition each code stands for")
        assert "This cannot be undone." in explanation
        warnings = [text for text in texts if "not complete" in text]
        ending = "Operators of the remaining sessions will no longer be blinded."
        assert warnings == ([f"{begins} {ending}"] if count else [])


def test_an_exclusion_is_reversed_and_a_proposal_rejected(qtbot: Any) -> None:
    parent = QWidget()
    qtbot.addWidget(parent)
    ending = "Your name, the reason and the time are stored in exclusions_reversed.jsonl."
    assert confirm_question(qtbot, take_back_question(parent, LIGHT, exclusion(4, "BL")))[:3] == (
        "Include again: P007, session 2, trial 4",
        f"Reason for the exclusion: “slept”. The data will be included again in measures, figures and tests. {ending}",
        "Include again",
    )
    assert confirm_question(qtbot, take_back_question(parent, LIGHT, exclusion(None, "fast_answers", "")))[:3] == (
        "Keep: P007, session 2",
        f"A rule proposed this exclusion: slept. The data will remain in measures, figures and tests. {ending}",
        "Keep",
    )


def test_an_exclusion_is_of_the_chosen_session_and_trial_and_of_its_rule_only_if_nothing_else_is_chosen(
    qtbot: Any,
) -> None:
    parent = QWidget()
    qtbot.addWidget(parent)
    sessions = [session("P003", 1), session("P007", 2)]
    trials = {("P003", 1): ((5, "thin"),), ("P007", 2): ((2, "thick"), (4, "late"))}
    proposed = exclusion(None, "fast_answers", "")
    dialog = LeaveOutDialog(parent, LIGHT, sessions, trials, sessions[0], proposed)
    assert dialog.said.text().startswith("P007, session 2 meets the exclusion rule “fast answers”. The chosen session")
    assert (dialog.chosen, dialog.rule, dialog.value("reason")) == (("P007", 2, None), "fast_answers", "slept")
    dialog.editors["trial"].show_value(4)
    assert (dialog.chosen, dialog.rule) == (("P007", 2, 4), "")
    qtbot.addWidget(dialog)
    dialog = LeaveOutDialog(parent, LIGHT, sessions, trials, sessions[1])
    assert dialog.said.text().startswith("The chosen session or trial is excluded from measures, figures and tests.")
    assert (dialog.chosen, dialog.rule, dialog.value("reason")) == (("P007", 2, None), "", "")
    title, _, button, texts = confirm_question(qtbot, dialog)
    assert (title, button, dialog.value("by")) == ("Exclude from the analysis", "Exclude", "AK")
    assert [text for text in texts if text in {"Session", "Scope", "By", "Reason"}] == [
        "Session", "Scope", "By", "Reason"
    ]  # fmt: skip


def test_outputs_go_into_the_chosen_folder_with_the_chosen_extras(qtbot: Any, tmp_path: Path) -> None:
    parent = QWidget()
    qtbot.addWidget(parent)
    files = [tmp_path / "report.html", tmp_path / "trials.csv"]
    extras = [Extra("bids", "BIDS"), Extra("motion", "Motion", "is sealed"), Extra("video", "Videos")]
    for opens_file, opens, result in ((True, "Open the report", files[0]), (False, "Open the folder", tmp_path)):
        dialog = WriteDialog(
            parent, LIGHT, "Export oils", "Tables.", go_on="Export", to=tmp_path, extras=extras, opens_file=opens_file
        )
        qtbot.addWidget(dialog)
        assert dialog.asked == (tmp_path, ())
        enabled = {extra.name: dialog.editors[extra.name].control.isEnabled() for extra in extras}
        assert enabled == {"bids": True, "motion": False, "video": True}
        dialog.editors["video"].show_value(True)
        assert dialog.asked == (tmp_path, ("video",))
        dialog.show_written(files, ["first differs", "second differs", "third differs", "fourth", "fifth"])
        assert dialog.said.text() == (f"2 files in {tmp_path}.\nfirst differs\nsecond differs\nthird differs 2 more.")
        assert (dialog.go_on.text(), dialog.result_path) == (opens, result)
    dialog.show_written(files, ["first", "second", "third"])
    assert dialog.said.text().endswith("\nthird")
