"""The curves of the lab's cards: fewer points than samples, and every peak."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from PySide6.QtGui import QColor

from study_app.gui.lab.cards import SpeedCard
from study_app.gui.lab.lab_state import CostRow, ErrorRow, LabView
from study_app.lab.live import LimiterCount
from study_app.lab.shadow import Trace

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("count", [1, 7, 240, 241, 2503])
def test_a_curve_keeps_the_newest_sample_and_every_peak(place: Any, still: LabView, count: int) -> None:
    for peak in range(max(0, count - 12), count):
        speed, none = np.zeros(count), np.zeros((count, 3))
        speed[peak] = 7.0
        values = {field.name: none if field.name.endswith("_n") else speed for field in dataclasses.fields(Trace)}
        trace = Trace(**(values | {"t_s": np.arange(count) / 1000}))
        place.show_view(dataclasses.replace(still, trace=trace))
        times, kept = place.speed.plot.curves[0].getData()
        assert len(times) == len(kept) <= 2 * 240
        assert times[-1] == (count - 1) / 1000
        assert np.count_nonzero(kept == 7.0) == 1


def test_each_name_in_a_legend_matches_the_curve_of_its_colour(place: Any, still: LabView) -> None:
    drawn = {"body_mps": 1.0, "wake_a_mps": 2.0, "wake_b_mps": 3.0, "force_a_n": 4.0, "force_b_n": 5.0}
    values = {field.name: np.zeros((3, 3) if field.name.endswith("_n") else 3) for field in dataclasses.fields(Trace)}
    for name, value in drawn.items():
        values[name][..., 0] = value
        values[name][1] = value if name.endswith("_mps") else (0, value, 0)
        values[name][2] = value if name.endswith("_mps") else (0, 0, -value)
    trace = Trace(**(values | {"t_s": np.array([-0.2, -0.1, 0.0])}))
    view = dataclasses.replace(still, trace=trace)
    for presented, force_a, force_b in (
        ("A", "A (felt now)", "B (same motion)"),
        ("B", "A (same motion)", "B (felt now)"),
    ):
        place.show_view(dataclasses.replace(view, workbench=dataclasses.replace(view.workbench, presented=presented)))
        for card, names in (
            (place.speed, {"body": 1.0, "wake of A": 2.0, "wake of B": 3.0}),
            (place.force, {force_a: 4.0, force_b: 5.0}),
        ):
            colours = {QColor(style.colour(card.plot.theme)).name(): text for style, text in card.legend._entries}
            curves = {colours[curve.opts["pen"].color().name()]: curve.getData()[1] for curve in card.plot.curves}
            assert {name: set(values) for name, values in curves.items()} == {name: {v} for name, v in names.items()}


def test_a_scale_has_as_many_round_ticks_as_fit_and_shrinks_below_half(qtbot: Any) -> None:
    card = SpeedCard()
    qtbot.addWidget(card)
    card.show()
    plot = card.plot
    times_s = np.array([-0.2, 0.0])
    for height, peak, ticks in (
        (240, 0.3, (0, 0.1, 0.2, 0.3, 0.4, 0.5)),  # never less than 0.5 m/s
        (240, 0.9, (0, 0.2, 0.4, 0.6, 0.8, 1)),
        (240, 3.2, (0, 1, 2, 3, 4)),
        (240, 2.0, (0, 1, 2, 3, 4)),
        (240, 1.7, (0, 0.5, 1, 1.5, 2)),
        (105, 1.7, (0, 1, 2)),  # three ticks fit
    ):
        plot.setFixedHeight(height)
        qtbot.waitUntil(lambda height=height: plot.height() == height)
        plot.show_curves(times_s, (np.zeros(2), np.array([0.1, peak]), np.zeros(2)))
        positions, texts = zip(*plot.ticks["left"], strict=True)
        assert positions == pytest.approx(ticks)
        assert [float(text) for text in texts] == pytest.approx(ticks)
        bottom, top = plot.box.viewRange()[1]
        assert (bottom, top * (1 - 9 / plot.box.height())) == pytest.approx((-0.02 * ticks[-1], ticks[-1]))


def test_costs_errors_and_limiters_are_listed_with_their_values(place: Any, still: LabView) -> None:
    view = dataclasses.replace(
        still,
        cost=(
            CostRow(effect="drag", ns=12345.4),
            CostRow(effect="swirl", ns=0.6),
            CostRow(effect="wake", ns=None, why="off"),
        ),
        tick_ns=None,
        measuring=False,
        errors=(ErrorRow(measure="Largest force error", value="0.004 N", note="of 3 s"),),
        limiters=(LimiterCount("slope", 45678, True), LimiterCount("size", 3, False), LimiterCount("speed", 0, False)),
    )
    place.show_view(view)
    assert [line.accessibleName() for line in place.cost.lines] == ["drag: 12345 ns", "swirl: < 1 ns"]
    assert [line.ns.text() for line in place.cost.lines] == ["12345 ns", "< 1 ns"]
    assert [(line.name.text(), line.why.whole) for line in place.cost.absent] == [("wake", "off")]
    period_ms = 1000 / view.workbench.in_hand.scene.rate_hz
    assert place.cost.sum.text() == f"12\u2009346 ns of {period_ms:g} ms"
    assert place.cost.aside.text() == "A, measured"
    errors = [(line.name.whole, line.value.text(), line.value.toolTip()) for line in place.error.lines]
    assert errors == [("Largest force error", "0.004 N", "of 3 s")]
    limiters = [(line.name.whole, line.word.text(), line.count.text()) for line in place.limiters.lines]
    assert limiters == [("slope", "acting now", "45\u2009678"), ("size", "acted", "3"), ("speed", "", "0")]
    names = [line.accessibleName() for line in place.limiters.lines]
    assert names == ["slope: acting now, 45678 ticks", "size: acted, 3 ticks", "speed: inactive, 0 ticks"]
    place.show_view(dataclasses.replace(view, tick_ns=23456.0))
    assert place.cost.sum.text() == f"23\u2009456 ns of {period_ms:g} ms"
    place.show_view(dataclasses.replace(view, cost=(), errors=(), measuring=True))
    assert [line.ns.text() for line in place.cost.lines] == ["–", "–"]
    assert (place.cost.sum.text(), place.cost.aside.text()) == ("–", "A, measuring…")
    assert [(line.name.whole, line.value.text()) for line in place.error.lines] == [("Largest force error", "–")]
