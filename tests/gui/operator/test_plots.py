"""Tiles and plots of the operator's window: their texts, curves, ticks and scales."""

from typing import Any

import numpy as np
import pytest
from pyqtgraph import InfiniteLine
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QLabel

from study_app.gui.operator.plots import ForceCard, HiddenForceCard, LatenessCard, PositionCard, Tiles
from study_app.gui.operator.servo_health import ServoHealth, Tile
from study_app.gui.theme.theme import DARK, LIGHT
from study_app.gui.widgets.cards import Chip, MaskedPanel
from study_app.gui.widgets.live_plots import LatenessPlot, TracePlot, tick_step
from tests.gui.operator.session import new_session, ticks
from tests.gui.windows import show_window

TIMES_S = np.array([-9.0, -4.0, -1.0])


def grid_lines(plot: TracePlot) -> list[InfiniteLine]:
    lines = (item for item in plot.scene().items() if isinstance(item, InfiniteLine))
    return sorted(lines, key=InfiniteLine.value)


def test_each_tile_shows_and_speaks_its_number_and_verdict(qtbot: Any) -> None:
    tiles = show_window(qtbot, Tiles(), (900, 120))
    card = tiles.cards[2]
    for verdict, icon, ink, meaning in (
        ("ok", "check", "ok", "within limits"),
        ("late", "warning", "warn", "outside limits"),
        ("open", "ring", "text3", "not measured yet"),
    ):
        card.show_tile(Tile(title="Rate", value="998", unit="Hz", verdict=verdict, line="of 1000 Hz"))  # type: ignore[arg-type]
        assert card.accessibleName() == f"Rate: 998 Hz, {meaning}, of 1000 Hz"
        assert (card.sign.name, card.sign.ink, card.line.whole) == (icon, ink, "of 1000 Hz")
        assert [part.text() for part in (card.title, card.value, card.unit)] == ["Rate", "998", "Hz"]
    view = new_session().view()
    for narrow, places in ((True, [(0, 0), (0, 1), (1, 0), (1, 1)]), (False, [(0, place) for place in range(4)])):
        tiles.set_narrow(narrow)
        tiles.show_view(view)
        assert [card.title.text() for card in tiles.cards] == [tile.title for tile in view.tiles]
        assert [tiles.layout().getItemPosition(at)[:2] for at in map(tiles.layout().indexOf, tiles.cards)] == places


def test_a_trace_is_drawn_over_time_with_its_name_at_its_end_and_a_range_that_grows(qtbot: Any) -> None:
    plot = show_window(qtbot, TracePlot(10.0, 50.0), (420, 300))
    seconds = [(0, "0 s"), (-2, "−2 s"), (-4, "−4 s"), (-6, "−6 s"), (-8, "−8 s"), (-10, "−10 s")]
    assert not any(end.isVisible() for end in plot.ends)
    for newest, texts in (
        ((-30.0, 5.0, 40.0), ["−60", "−40", "−20", "0", "20", "40", "60"]),
        ((-7.0, -130.0, 20.0), ["−150", "−100", "−50", "0", "50", "100", "150"]),
    ):
        values = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], newest])
        plot.show_traces(TIMES_S, values)
        assert [curve.yData.tolist() for curve in plot.curves] == values.T.tolist()
        assert [curve.xData.tolist() for curve in plot.curves] == [TIMES_S.tolist()] * 3
        assert plot.ticks == {"bottom": seconds, "left": [(int(text.replace("−", "-")), text) for text in texts]}
        assert all(plot.axes[side]._tickLevels == [plot.ticks[side]] for side in plot.ticks)
        assert [line.value() for line in grid_lines(plot)] == [value for value, _ in plot.ticks["left"]]
        names = dict(zip(("x right", "y up", "z near"), newest, strict=True))
        assert {end.toPlainText(): end.pos().y() for end in plot.ends} == names
    plot.show_traces(TIMES_S, np.zeros((3, 3)))
    heights = [end.pos().y() for end in plot.ends]
    assert np.diff(heights) == pytest.approx([plot._name_height] * 2)
    assert heights[1] == pytest.approx(0, abs=0.01)
    steps = {(50.0, 3): 20, (60.0, 3): 20, (61.0, 3): 50, (9.0, 1): 10, (0.8, 8): 0.1}
    assert [tick_step(*reach_and_count) for reach_and_count in steps] == pytest.approx([*steps.values()])


def test_grid_lines_are_horizontal_behind_the_curves_and_in_the_colour_of_the_theme(qtbot: Any) -> None:
    plot = show_window(qtbot, TracePlot(10.0, 50.0), (420, 300))
    for theme in (LIGHT, DARK):
        plot.apply_theme(theme)
        plot.show_ticks("bottom", [(-7.0, "−7 s")])
        assert [(line.value(), line.angle) for line in grid_lines(plot)] == [(20 * row, 0) for row in range(-3, 4)]
        assert {line.pen.color().name() for line in grid_lines(plot)} == {QColor(theme.grid).name()}
        assert all(line.zValue() < curve.zValue() for line in grid_lines(plot) for curve in plot.curves)


def test_a_histogram_has_bars_by_decades_a_percentile_and_the_limit(qtbot: Any) -> None:
    plot = show_window(qtbot, LatenessPlot(2000.0), (640, 300))
    edges_us, counts = np.array([1.0, 10.0, 100.0, 1000.0, 10_000.0]), np.array([0, 3, 100_000, 10])
    plot.show_histogram(edges_us, counts, 50.4)
    assert plot.bars.opts["x"] == pytest.approx([1.5, 2.5, 3.5])
    assert plot.bars.opts["height"] + plot.bars.opts["y0"] == pytest.approx([np.log10(3), 5, 1])
    assert (plot.p99_name.toPlainText(), plot.limit_name.toPlainText()) == ("p99 50", "limit 2\u2009000")
    assert plot.p99_line.xData == pytest.approx(np.log10([50.4, 50.4]))
    assert plot.p99_line.yData == pytest.approx([-0.3, np.log10(3) + 0.3])
    assert plot.limit_line.value() == pytest.approx(np.log10(2000))
    texts = ["1", "10", "100", "1\u2009000", "10\u2009000", "100\u2009000"]
    assert plot.ticks == {"left": [*enumerate(texts)], "bottom": [*enumerate(texts[:5])]}
    for p99_us in (None, 7.0):
        plot.show_histogram(edges_us, counts, p99_us)
        assert plot.p99_name.isVisible() == plot.p99_line.isVisible() == (p99_us is not None)


def test_the_force_scale_fits_the_force_and_shows_the_limit_only_within_it(qtbot: Any) -> None:
    card = show_window(qtbot, ForceCard(8.0), (500, 320))
    plot = card.plot
    for size_n, reach_n in ((1.0, 1.5), (1.4, 1.5), (0.02, 1.0), (7.9, 10.0), (6.0, 10.0), (3.0, 4.0)):
        forces_n = np.array([[0.0, 0.0, 0.0, 0.0], [-size_n, 0.1, 0.2, size_n], [0.3, 0.0, 0.4, 0.5 * size_n]])
        plot.show_forces(TIMES_S, forces_n)
        assert plot.reach == pytest.approx(reach_n), size_n
        assert plot.magnitude_area.yData.tolist() == plot.curves[3].yData.tolist() == forces_n[:, 3].tolist()
        assert {part.isVisible() for part in (*plot.limits, plot.limit_name)} == {reach_n >= 8}
    assert ([line.value() for line in plot.limits], plot.limit_name.toPlainText()) == ([8.0, -8.0], "limit 8 N")


def test_each_card_names_its_quantity_and_unit(qtbot: Any) -> None:
    health = ServoHealth(1000.0)
    health.add_samples(ticks(300, lateness_ns=47_000))
    for at_s, position_m in ((1.0, (0.01, -0.02, 0.03)), (2.5, (0.04, 0.015, -0.006))):
        health.add_hand_position(at_s, position_m)
    lateness, hidden = LatenessCard(0.002), HiddenForceCard()
    hand, pointer = (PositionCard(0.05, pointer=pointer) for pointer in (False, True))
    for card, heading, aside, name in (
        (ForceCard(6.5), "Force", "last 10 s, N; limit 6.5", "Force on the hand"),
        (lateness, "Tick lateness", "last 60 s", "Tick lateness"),
        (hand, "Position of the hand", "last 10 s, mm", "Position of the hand"),
        (pointer, "Position of the pointer", "last 10 s, mm", "Position of the pointer"),
    ):
        qtbot.addWidget(card)
        assert [part.text() for part in card.findChildren(QLabel)][:2] == [heading, aside]
        assert card.plot.accessibleName() == name
    assert "The limit is 6.5 N." in ForceCard(6.5).plot.accessibleDescription()
    for part, description in ((lateness, "over the last minute, in µs."), (hand, "over the last 10 s, in mm.")):
        assert part.plot.accessibleDescription().endswith(description)
    hand.show_health(health, 4.0)
    assert [curve.yData.tolist() for curve in hand.plot.curves] == [
        pytest.approx([10, 40]), pytest.approx([-20, 15]), pytest.approx([30, -6])
    ]  # fmt: skip
    assert hand.plot.curves[0].xData == pytest.approx([-3.0, -1.5])
    lateness.show_health(health)
    names = lateness.plot.p99_name, lateness.plot.limit_name
    assert [name.toPlainText() for name in names] == ["p99 47", "limit 2\u2009000"]
    qtbot.addWidget(hidden)
    (chip,), (panel,) = hidden.findChildren(Chip), hidden.findChildren(MaskedPanel)
    assert (chip.tone, chip.icon, chip.word) == ("neutral", "eye_off", "Hidden")
    assert panel.accessibleName() == "Hidden because the study is double-blind. The trace would reveal the liquid."
