"""The plots' names stand apart and inside, whatever is drawn."""

from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QRectF
from PySide6.QtWidgets import QApplication

from study_app.gui.widgets.live_plots import LatenessPlot, TracePlot

LIMIT_US = 2000.0


def place(name: Any) -> QRectF:
    return name.textItem.mapRectToScene(name.textItem.boundingRect())


@pytest.mark.slow
@pytest.mark.parametrize("size", [(320, 150), (420, 200), (900, 420)])
@pytest.mark.parametrize("p99_us", [3.0, 66.0, 700.0, 2000.0, 9000.0])
@pytest.mark.parametrize("decades", [4, 5, 6])
def test_the_names_of_limit_and_p99_do_not_touch(
    qtbot: Any, size: tuple[int, int], p99_us: float, decades: int
) -> None:
    plot = LatenessPlot(LIMIT_US)
    qtbot.addWidget(plot)
    plot.resize(900, 420)
    plot.show()
    qtbot.waitExposed(plot)
    edges = np.logspace(0, decades, 10 * decades + 1)
    plot.show_histogram(edges, np.full(10 * decades, 10_000), p99_us)
    plot.resize(*size)
    QApplication.processEvents()
    limit, p99 = place(plot.limit_name), place(plot.p99_name)
    assert plot.limit_name.isVisible()
    assert plot.p99_name.isVisible()
    assert not limit.intersects(p99)
    inside = plot.box.mapRectToScene(plot.box.boundingRect()).adjusted(0, -1, 0, 1)
    assert inside.top() <= limit.top() < limit.bottom() <= p99.top() + 1
    assert p99.bottom() <= inside.bottom()


def test_what_was_changed_is_painted_at_once_and_not_again_later(qtbot: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    plot = TracePlot(10.0, 50.0)
    qtbot.addWidget(plot)
    plot.resize(420, 200)
    plot.show()
    qtbot.waitExposed(plot)
    QApplication.processEvents()
    painted: list[int] = []
    paint = TracePlot.paintEvent
    monkeypatch.setattr(TracePlot, "paintEvent", lambda self, event: (painted.append(1), paint(self, event))[1])
    times_s = np.linspace(-10, 0, 100)
    for turn in range(5):
        plot.show_traces(times_s, np.column_stack([np.sin(times_s + turn)] * 3))
        assert len(painted) == turn
        plot.paint_now()
        assert len(painted) == turn + 1
        QApplication.processEvents()
    assert len(painted) == 5
