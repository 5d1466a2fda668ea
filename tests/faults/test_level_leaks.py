"""A session of levels to its end: nothing that can be seen, read or logged tells a level, standard or comparison."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication, QLabel

from study_app import app
from study_app.gui.operator import OperatorWindow
from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.load import load
from study_app.session import start
from study_app.store.verification.leaks import leaks, presented_numbers, telltales
from tests.compiled import needs_servo
from tests.faults.support.windows import Person, traces_of, words_of
from tests.protocol.trials.studies import BLOCK, HEAD

pytestmark = [pytest.mark.slow, needs_servo, pytest.mark.usefixtures("qapp")]

# Levels, standards and parameters that occur nowhere by chance.
EDITS = (
    ("viscosity_pa_s = 1\n", "viscosity_pa_s = 1.3717\n"),
    ("viscosity_pa_s = 4\n", "viscosity_pa_s = 4.1213\n"),
    ("density_kg_m3 = 1000\n", "density_kg_m3 = 1013.7\n"),
    ("density_kg_m3 = 1260\n", "density_kg_m3 = 1261.9\n"),
    ("delay_ms = 100", "delay_ms = 137.31"),
    ("standards = [1, 2]", "standards = [1.3717, 2.1193]"),
    ("levels = [0.2, 0.4, 0.8]\nrepetitions = 8", "levels = [0.2371, 0.7793]\nrepetitions = 1"),
    ("min_s = 1\nmax_s = 3", "min_s = 0.2\nmax_s = 0.5"),
    ("liquids.thin", "liquids.quagmire"),
    ("liquids.thick", "liquids.mildew"),
    ('liquid = "thin"', 'liquid = "quagmire"'),
    ('liquid = "thick"', 'liquid = "mildew"'),
    ("conditions.oil", "conditions.feel_quagmire"),
    ('condition = "oil"', 'condition = "feel_quagmire"'),
    ("conditions.other", "conditions.feel_mildew"),
    ("conditions.late", "conditions.see_tardy"),
)


def test_nothing_seen_written_or_logged_tells_a_level(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(start, "MEASURED_S", 0.1)
    caplog.set_level(logging.DEBUG)
    text = HEAD + BLOCK
    for old, new in EDITS:
        assert old in text, old
        text = text.replace(old, new)
    path = tmp_path / "levels.toml"
    path.write_text(text)
    said: set[str] = set()

    def watch(participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        for top in QApplication.topLevelWidgets():
            said.update(words_of(top))
        said.update(traces_of(operator))
        said.add(repr(participant.page))
        return False

    told: list[str] = []
    person = Person(watch)
    code = app.run(
        str(path),
        participant="P001",
        device="scripted",
        windowed=True,
        seed=3,
        operator="AK",
        results=tmp_path / "results",
        tell=told.append,
    )
    person.leave()
    assert code == 0
    protocol = load(str(path))
    assert {0.2371, 2.1193, 1.3717 + 1.3717 * 0.2371} <= presented_numbers(protocol)
    words = telltales(protocol)
    for line in (*said, *told, *(record.getMessage() for record in caplog.records)):
        assert words.in_text(line) == [], line
    assert leaks(tmp_path / "results", protocol) == []
    assert any("answered" in line for line in said), "the operator saw how the track is doing"

    planted = QLabel("Pair 1")
    planted.setAccessibleName("Pair 1, level 0.2371")
    assert [word for line in words_of(planted) for word in words.in_text(line)] == ["0.2371"]
