"""A session to its end: nothing that can be read tells a condition, nor, while it is double-blind, can be seen."""

import logging
import re
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtWidgets import QApplication

from study_app import app
from study_app.gui.operator import OperatorWindow
from study_app.gui.operator.force_plots import ForceCard
from study_app.gui.operator.plot_cards import HiddenForceCard
from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.load import load, source_bytes
from study_app.session import start
from study_app.session.pages import TaskPage
from study_app.store import receipt
from study_app.store.folders import StudyFolder
from study_app.store.verification.leaks import Telltales, find_leaks, telltales
from tests.compiled import needs_servo
from tests.faults.support import short
from tests.faults.support.watched_program import Person, traces_of, words_of

pytestmark = [pytest.mark.slow, needs_servo, pytest.mark.usefixtures("qapp")]

# Ids, parameters and delays that occur nowhere by chance.
CONCEALED = (
    (r"\bliquids\.thin\b", "liquids.quagmire"),
    (r"\bliquids\.thick\b", "liquids.mildew"),
    (r'liquid = "thin"', 'liquid = "quagmire"'),
    (r'liquid = "thick"', 'liquid = "mildew"'),
    (r"conditions\.thin\b", "conditions.feel_quagmire"),
    (r"conditions\.thick\b", "conditions.feel_mildew"),
    (r"conditions\.prompt\b", "conditions.see_brisk"),
    (r"conditions\.late\b", "conditions.see_tardy"),
    (r'\["thin", "thick"\]', '["feel_quagmire", "feel_mildew"]'),
    (r'\["prompt", "late"\]', '["see_brisk", "see_tardy"]'),
    (r"density_kg_m3 = 1000\b", "density_kg_m3 = 1013.7"),
    (r"density_kg_m3 = 1400\b", "density_kg_m3 = 1391.3"),
    (r"length = 1700\b", "length = 1717"),
    (r"scaling = 1700\b", "scaling = 1931"),
    (r"exponent = 0\.75", "exponent = 0.7513"),
    (r"delay_ms = 200\b", "delay_ms = 137.31"),
)


@pytest.fixture(params=["double", "single"])
def blinding(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def concealed(tmp_path: Path, blinding: str) -> Path:
    path = short.write(tmp_path)
    text = path.read_text(encoding="utf-8")
    for pattern, word in (*CONCEALED, (r'blinding = "double"', f'blinding = "{blinding}"')):
        text, found = re.subn(pattern, word, text)
        assert found, pattern
    path.write_text(text, encoding="utf-8")
    return path


def test_nothing_seen_written_or_logged_tells_a_condition(
    concealed: Path, blinding: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(start, "MEASURED_S", 0.1)
    caplog.set_level(logging.DEBUG)
    said: set[str] = set()
    tasks: set[int] = set()
    forces: list[Any] = []

    def watch(participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        for top in QApplication.topLevelWidgets():
            said.update(words_of(top))
        said.update(traces_of(operator))
        said.add(repr(participant.page))
        if isinstance(participant.page, TaskPage):
            tasks.add(participant.page.trial)
            operator.mark_set.emit()
        forces.append(type(operator.force))
        return False

    told: list[str] = []
    results = tmp_path / "results"
    protocol = load(str(concealed))
    assert source_bytes(str(concealed))
    person = Person(watch)
    code = app.run(
        str(concealed),
        participant="P001",
        device="scripted",
        windowed=True,
        seed=3,
        operator="AK",
        results=results,
        progress=told.append,
    )
    person.leave()
    assert code == 0
    assert tasks == {1, 2, 3, 4}
    words = telltales(protocol)
    assert {"quagmire", "1013.7", "1717", "137.31", "see_tardy"} <= words.words
    logged = [record.getMessage() for record in caplog.records]
    shown = words
    if blinding == "single":  # the operator sees forces and counts, which may be any short number
        shown = Telltales(word for word in words.words if not word[0].isdigit() or len(word) > 5)
    for text in (*said, *told, *logged):
        assert shown.in_text(text) == [], text
    assert find_leaks(results, telltales(protocol)) == []
    assert set(forces) == {HiddenForceCard if blinding == "double" else ForceCard}
    assert [receipt.read(one.receipt)["protocol"]["study"]["blinding"] for one in StudyFolder(results).sessions()] == [
        blinding
    ]
    assert len(said) > 100
