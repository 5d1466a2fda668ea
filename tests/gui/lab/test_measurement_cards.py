"""Plots and the right column: numbers, units, heights that do not jump, and what is said of a limiter."""

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from PySide6.QtWidgets import QApplication

from study_app.gui.lab.lab_plots import POINTS, A, B, CurvePlot, thinned
from study_app.viewmodels.lab import CostRow, LabView

pytestmark = pytest.mark.slow


@dataclass
class Limiter:
    name: str
    ticks: int
    acting: bool


@pytest.fixture
def plot(qtbot: Any) -> CurvePlot:
    made = CurvePlot((B, A), 1.0)
    qtbot.addWidget(made)
    made.resize(340, 260)
    made.show()
    qtbot.waitExposed(made)
    return made


def top(plot: CurvePlot) -> float:
    return max(place for place, _ in plot.ticks["left"])


def test_the_height_grows_at_once_and_shrinks_only_by_half(plot: CurvePlot) -> None:
    t_s = np.linspace(-2.5, 0, 50)
    tops = []
    for peak in (0.5, 3.9, 3.0, 2.0, 1.0, 0.5):
        plot.show_curves(t_s, (np.full(50, peak), np.zeros(50)))
        tops.append(top(plot))
    assert tops[0] == 1
    assert tops[1:4] == [4, 4, 4]
    assert tops[4] < 4
    assert tops[5] == 1


def test_the_limit_is_always_inside(plot: CurvePlot) -> None:
    plot.show_curves(np.empty(0), (np.empty(0), np.empty(0)), limit=8.0)
    assert top(plot) >= 8
    assert plot.limit.isVisible()
    assert plot.limit.value() == 8.0


@pytest.mark.parametrize("count", [0, 1, 7, 240, 241, 2500])
def test_thinning_keeps_the_newest_and_every_peak(count: int) -> None:
    t_s = np.arange(count, dtype=float)
    for peak in range(max(0, count - 30), count):
        values = np.zeros(count)
        values[peak] = 7.0
        times, kept = thinned(t_s, values)
        assert len(times) == len(kept) <= 2 * 240
        assert times[-1] == count - 1
        assert np.count_nonzero(kept == 7.0) == 1


def test_both_forces_are_drawn_and_named(place: Any, moved: LabView) -> None:
    place.show_view(moved)
    assert moved.trace is not None
    (t_b, b), (_t_a, a) = (curve.getData() for curve in place.force.plot.curves)
    assert t_b[-1] == 0
    newest = len(moved.trace.t_s) // POINTS
    assert a[-1] == pytest.approx(np.linalg.norm(moved.trace.force_a_n[-newest:], axis=1).max())
    assert b[-1] == pytest.approx(np.linalg.norm(moved.trace.force_b_n[-newest:], axis=1).max())
    assert place.force.legend.accessibleName() == "A, felt now, B, same motion, limit 8 N"
    place.show_view(dataclasses.replace(moved, workbench=moved.workbench.switch()))
    assert place.force.legend.accessibleName() == "A, same motion, B, felt now, limit 8 N"


def test_costs_are_bars_of_the_dearest_and_absent_ones_say_why(place: Any, still: LabView) -> None:
    place.show_view(still)
    card = place.cost
    assert [(line.name.whole, line.ns.text()) for line in card.lines][:2] == [("Wake", "84 ns"), ("Safety", "31 ns")]
    assert [line.bar.share for line in card.lines][:2] == [1.0, pytest.approx(31 / 84)]
    assert (card.absent[0].name.text(), card.absent[0].why.whole) == ("Buoyancy", "out, 0.00 N")
    assert card.sum.text() == "161 ns of 1 ms"
    assert card.aside.text() == "A, measured"
    place.show_view(dataclasses.replace(still, cost=(CostRow("Drag", 20.0),), tick_ns=None, measuring=True))
    assert (len(card.lines), len(card.absent)) == (1, 0)
    assert (card.sum.text(), card.aside.text()) == ("20 ns of 1 ms", "A, measuring …")
    place.show_view(dataclasses.replace(still, cost=(), errors=()))
    assert card.sum.text() == "not measured yet"
    assert [line[0].whole for line in place.error.lines if line[0].isVisible()] == ["Not measured yet"]


def test_nothing_jumps_while_a_slider_is_dragged(place: Any, still: LabView) -> None:
    place.show_view(still)
    for _ in range(4):
        QApplication.processEvents()
    before = [card.geometry() for card in (place.cost, place.error, place.limiters)]
    for _ in range(3):
        place.show_view(dataclasses.replace(still, cost=(), errors=(), tick_ns=None, measuring=True))
        QApplication.processEvents()
    assert [card.geometry() for card in (place.cost, place.error, place.limiters)] == before
    assert {line.ns.text() for line in place.cost.lines} == {"–"}
    assert {value.text() for _, value in place.error.lines} == {"–"}
    assert place.cost.sum.text() == "–"
    assert place.cost.lines[0].accessibleName() == "Wake: measuring"
    place.show_view(still)
    assert [line.ns.text() for line in place.cost.lines][:2] == ["84 ns", "31 ns"]
    assert place.error.lines[0][1].text() == "4e−15"


def test_a_limiter_says_what_it_does(place: Any, still: LabView) -> None:
    told = (Limiter("Slew", 14, acting=True), Limiter("Fade", 500, acting=False), Limiter("Force", 0, acting=False))
    place.show_view(dataclasses.replace(still, limiters=told))
    lines = place.limiters.lines
    assert [line.word.text() for line in lines] == ["acting now", "acted", ""]
    assert [line.count.text() for line in lines] == ["14", "500", "0"]
    assert lines[0].accessibleName() == "Slew: acting now, 14 ticks"
    assert lines[2].accessibleName() == "Force: did not act, 0 ticks"
    quiet = tuple(Limiter(one.name, 0, acting=False) for one in told)
    place.show_view(dataclasses.replace(still, limiters=quiet))
    assert [line.word.text() for line in lines] == ["", "", ""]
