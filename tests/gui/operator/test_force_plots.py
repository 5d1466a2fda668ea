"""Force and wake as they are drawn: a scale that follows, a limit that stands, names that do not touch."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QApplication, QLabel

from study_app.gui.operator.force_plots import ForceCard
from study_app.gui.widgets.live_plots import STROKE, apart, step_for
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


@pytest.mark.parametrize("peak_n", [0.02, 0.3, 0.9, 2.0, 5.0, 8.0])
def test_every_force_is_inside_and_seen(card: ForceCard, peak_n: float) -> None:
    show(card, pushed(peak_n))
    low, high = card.plot.box.viewRange()[1]
    assert low < -peak_n
    assert peak_n < high
    assert high <= max(1.2, 7 * peak_n)


def test_the_scale_narrows_when_the_push_has_passed_and_the_limit_is_seen_where_it_is_near(card: ForceCard) -> None:
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


def test_a_scale_that_fits_stays(card: ForceCard) -> None:
    seen = set()
    for peak_n in (1.9, 1.8, 1.95, 1.7, 2.0):
        show(card, pushed(peak_n))
        seen.add(card.plot.reach)
    assert len(seen) == 1


@pytest.mark.slow
def test_the_wake_has_a_line_above_zero_at_every_speed(card: ForceCard) -> None:
    for speed in (0.0, 0.05, 0.28, 0.49, 1.3, 6.0):
        show(card, pushed(1.0, speed))
        rows, step = card.wake.rows_and_step
        assert rows >= 1
        assert rows * step <= card.wake.reach + 1e-9
        assert max(speed, 0.1) <= card.wake.box.viewRange()[1][1]


@pytest.mark.parametrize(
    "places", [(0.0, 0.0, 0.0, 0.0), (1.0, 1.0, 0.9, -1.0), (-1.0, -1.0, -1.0, 1.0), (0.2, -0.1, 0.5, 0.9)]
)
def test_names_keep_their_order_their_distance_and_the_plot(places: tuple[float, ...]) -> None:
    moved = apart(places, 0.3, 1.0)
    assert np.argsort(moved, kind="stable").tolist() == np.argsort(places, kind="stable").tolist()
    assert min(b - a for a, b in pairwise(sorted(moved))) >= 0.3 - 1e-9
    assert max(map(abs, moved)) <= 1.0 + 1e-9


@pytest.mark.parametrize("reach", [0.011, 0.1, 0.5, 1.0, 3.3, 8.0, 40.0, 75.0, 1234.0])
@pytest.mark.parametrize("most", [1, 2, 3])
def test_steps_are_even_and_few(reach: float, most: int) -> None:
    step = step_for(reach, most)
    assert reach / step <= most + 0.02
    assert reach / step > most / 2.6
    assert round(step / 10 ** np.floor(np.log10(step) + 1e-9), 9) in {1, 2, 5}


def test_strokes_are_as_wide_on_a_screen_of_twice_the_density(card: ForceCard, monkeypatch: pytest.MonkeyPatch) -> None:
    assert card.plot.curves[0].opts["pen"].widthF() == STROKE * card.plot.devicePixelRatioF()
    monkeypatch.setattr(type(card.plot), "devicePixelRatioF", lambda _plot: 2.0)
    QApplication.sendEvent(card.plot, QEvent(QEvent.Type.DevicePixelRatioChange))
    assert card.plot.curves[0].opts["pen"].widthF() == 2 * STROKE
