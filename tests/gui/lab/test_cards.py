"""The cards of the lab: plots, numbers, flow curves, the estimation, and nothing of it while blind."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PySide6.QtWidgets import QApplication, QFileDialog

from study_app.gui.lab.lab_plots import POINTS, A, B, CurvePlot, thinned
from study_app.lab.ab_comparison import Setting, Workbench
from study_app.lab.presets import spoken
from study_app.lab.steady_curves import RATES_PER_S, steady_curves
from study_app.protocol.load import load_scene
from study_app.viewmodels.estimation import LSL, SOURCES, EstimateRow, EstimateShown
from study_app.viewmodels.lab import CostRow, LabView
from tests.gui.lab.sample import blind, heard, still_view
from tests.gui.walk import settle

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
    plot.show_curves(np.empty(0), (np.empty(0), np.empty(0)), limit=8.0)
    assert top(plot) >= 8
    assert plot.limit.isVisible()


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


def bench(a: str, b: str) -> Workbench:
    scenes = {name: load_scene("slime", name) for name in (a, b)}
    return Workbench(*(Setting(spoken(name), scenes[name], scenes[name]) for name in (a, b)))


def test_flow_curves_are_shown_of_non_newtonian_liquids_and_follow_edits_and_the_limit(place: Any) -> None:
    for liquids, shown in ((None, False), (("water", "ketchup"), True), (("water", "honey"), False)):
        place.show_view(still_view(bench(*liquids) if liquids else None))
        assert place.curves.isVisible() is shown
    view = still_view(bench("ketchup", "honey"))
    place.show_view(view)
    settle(place)
    b, a = place.curves.stress.stresses.curves
    assert np.allclose(a.getData()[1], np.log10(15 + 10 * RATES_PER_S**0.25))
    assert np.allclose(b.getData()[1], np.log10(10 * RATES_PER_S))
    forces = place.curves.force.forces
    assert forces.curves[0].getData()[1].max() == steady_curves(view.workbench.b.scene).force_n.max()
    assert "thixotropy" in place.curves.stress.plot.accessibleDescription()
    place.show_view(still_view(view.workbench.change("non_newtonian.yield_stress_pa", 60.0)))
    assert np.allclose(a.getData()[1], np.log10(60 + 10 * RATES_PER_S**0.25))
    other = view.workbench.switch().change("scene.force_limit_n", 4.0)
    for shown_bench, limit_n in ((other, 4.0), (other.switch(), 8.0)):
        place.show_view(still_view(shown_bench))
        assert forces.limit.value() == limit_n


FOUND = EstimateShown(
    source="other",
    rows=(EstimateRow("Drag coefficient", "0.4203", "0.419 … 0.422"),),
    message="Residual 0.052 N, 12 % of the force; 10 s measured",
    sound=True,
    may_apply=True,
    may_follow=True,
)


def test_values_stand_with_their_intervals_and_are_applied_on_request_where_they_are_sound(
    place: Any, still: LabView
) -> None:
    def show(**changes: Any) -> None:
        place.show_view(dataclasses.replace(still, estimate=dataclasses.replace(FOUND, **changes)))

    said = {name: heard(place, name) for name in ("estimate_apply_asked", "estimate_follow_asked")}
    show()
    name, value, interval = place.estimate.lines[0]
    assert (name.whole, value.text(), interval.text()) == ("Drag coefficient", "0.4203", "0.419 … 0.422")
    assert place.estimate.message.text().startswith("Residual 0.052 N")
    place.estimate.apply.click()
    place.estimate.follow.click()
    assert said == {"estimate_apply_asked": [()], "estimate_follow_asked": [(True,)]}
    assert not place.estimate.follow.isChecked()  # the view says when it is
    show(follows=True)
    assert place.estimate.follow.isChecked()
    show(sound=False, may_apply=False, message="This motion does not identify it.")
    assert not place.estimate.apply.isEnabled()
    assert place.estimate.message.property("role") == "warn"


def test_sources_a_file_and_parameters_are_chosen(place: Any, still: LabView, tmp_path: Path) -> None:
    sources, parameters = heard(place, "estimate_source_chosen"), heard(place, "estimate_parameters_chosen")
    place.show_view(dataclasses.replace(still, estimate=dataclasses.replace(FOUND, sources=(*SOURCES, *LSL))))
    for at in (2, 4, 3):
        place.estimate.source.activated.emit(at)
    place.estimate.parameters.activated.emit(1)
    assert isinstance(place.dialog, QFileDialog)
    place.dialog.fileSelected.emit(str(tmp_path / "robot.csv"))
    place.dialog.reject()
    assert sources == [("device", None), ("lsl", None), ("file", tmp_path / "robot.csv")]
    assert parameters == [("wake",)]


def test_while_blind_neither_curves_nor_values_are_seen_and_nothing_moves(place: Any) -> None:
    view = still_view(bench("ketchup", "honey"), estimate=FOUND)
    place.show_view(view)
    settle(place)
    before = [place.curves.stress.size(), place.tank.size()]
    place.show_view(dataclasses.replace(view, workbench=blind(view.workbench)))
    settle(place)
    assert [place.curves.stress.size(), place.tank.size()] == before
    hidden = (place.curves.stress.plot, place.curves.force.plot, place.estimate.lines[0][1], place.estimate.source)
    assert not any(one.isVisible() for one in hidden)
