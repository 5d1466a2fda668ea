"""Force and wake as they are drawn: a scale that follows, a limit that stands, names that do not touch."""

from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QApplication, QLabel

from study_app.gui.operator.force_plots import ForceCard
from study_app.gui.widgets.live_plots import STROKE
from study_app.haptics.model.layout import SAMPLE, records
from study_app.viewmodels.force_traces import Forces

LIMIT_N = 8.0
SECONDS = 12.0


def pushed(peak_n: float, wake_mps: float = 0.2) -> Forces:
    """Return twelve seconds of a hand that is pushed to and fro."""
    samples = records(SAMPLE, int(SECONDS * 1000))
    samples.tick = np.arange(samples.size)
    samples.time_ns = samples.tick * 1_000_000
    turn = samples.tick / 300
    samples.device_force_n = peak_n * np.column_stack((np.sin(turn), 0.3 * np.cos(turn), 0 * turn))
    samples.wake_mps = wake_mps * np.column_stack((np.cos(turn), 0 * turn, 0 * turn))
    samples.scene = 1
    forces = Forces(LIMIT_N)
    forces.take(samples)
    return forces


@pytest.fixture
def card(qtbot: Any) -> ForceCard:
    made = ForceCard(LIMIT_N)
    qtbot.addWidget(made)
    made.resize(420, 280)
    made.show()
    qtbot.waitExposed(made)
    return made


def show(card: ForceCard, forces: Forces) -> None:
    card.show_forces(forces, round(SECONDS * 1e9))
    QApplication.processEvents()


def test_the_scale_narrows_when_the_push_has_passed_and_the_limit_is_seen_where_it_is_near(card: ForceCard) -> None:
    seen = set()
    for peak_n in (1.9, 1.8, 1.95, 1.7, 2.0):
        show(card, pushed(peak_n))
        seen.add(card.plot.reach)
    assert len(seen) == 1, "a scale that fits stays"
    assert card.wake.box.viewRange()[0] == card.plot.box.viewRange()[0], "both share their times"
    show(card, pushed(7.9))
    assert card.plot.limits[0].isVisible()
    assert card.plot.limit_name is not None
    assert card.plot.limit_name.isVisible()
    wide = card.plot.reach
    assert wide >= LIMIT_N
    show(card, pushed(0.4))
    assert card.plot.reach < wide / 4
    assert not card.plot.limits[0].isVisible()
    assert "limit 8" in card.findChildren(QLabel)[1].text()


def test_strokes_are_as_wide_on_a_screen_of_twice_the_density(card: ForceCard, monkeypatch: pytest.MonkeyPatch) -> None:
    assert card.plot.curves[0].opts["pen"].widthF() == STROKE * card.plot.devicePixelRatioF()
    monkeypatch.setattr(type(card.plot), "devicePixelRatioF", lambda _plot: 2.0)
    QApplication.sendEvent(card.plot, QEvent(QEvent.Type.DevicePixelRatioChange))
    assert card.plot.curves[0].opts["pen"].widthF() == 2 * STROKE
