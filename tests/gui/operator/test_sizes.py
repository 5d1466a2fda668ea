"""Nothing is clipped at any size, and the force stop neither moves, shrinks nor scrolls."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QRect
from PySide6.QtWidgets import QAbstractScrollArea, QApplication, QLabel, QPushButton, QWidget

from study_app.gui.operator import OperatorWindow
from study_app.gui.operator.force_plots import ForceCard
from study_app.gui.operator.stop_panel import LEAST_HEIGHT, LEAST_WIDTH
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import Elided
from study_app.haptics.model.layout import LIMITER_NORM, SAMPLE, records
from study_app.viewmodels.force_traces import Forces

pytestmark = pytest.mark.slow

SIZES = (
    (1024, 640),
    (1180, 704),
    (1250, 705),
    (1280, 720),
    (1320, 750),
    (1366, 768),
    (1499, 869),
    (1500, 870),
    (1600, 750),
    (1600, 900),
    (1920, 1080),
)

FEW = ((1024, 640), (1366, 768), (1600, 900))


def preparing(_told: Any) -> dict[str, Any]:
    return {}


def running(told: Any) -> dict[str, Any]:
    told.welcome()
    told.start(1)
    for text in ("Right-handed, no glasses.", "Adjusted the chair, elbow supported, asked twice whether all is well"):
        told.tell("note", 5.0, kind="note", text=text)
    told.end(1, worst_gap_ms=31.0)
    told.answer(1)
    told.start(2)
    return {}


def paused(told: Any) -> dict[str, Any]:
    running(told)
    told.tell("paused", by="operator")
    return {}


def force_off(told: Any) -> dict[str, Any]:
    running(told)
    told.tell("force_stopped", by="operator")
    told.tell("paused", by="operator")
    return {"force_on": False}


def trouble(told: Any) -> dict[str, Any]:
    running(told)
    what = "the device 'falcon' stopped responding or lost its guard; turn it off if it pushes, and reconnect it"
    told.tell("broke", what=what)
    return {"force_on": False, "device_ready": False, "faults": 2}


def waiting(told: Any) -> dict[str, Any]:
    running(told)
    return {"force_on": False, "trouble": "no space left on the disk: free some", "waits": True}


def ended(told: Any) -> dict[str, Any]:
    running(told)
    told.tell("session_ended", status="broken", reason="", fingerprint="wwww-mmmm-wwww")
    return {"force_on": False}


STATES = (preparing, running, paused, force_off, trouble, waiting, ended)


def pushes() -> Any:
    """Return samples of a hand that is pushed by 2 N, and limited often."""
    samples = records(SAMPLE, 4000)
    samples.tick = np.arange(4000)
    samples.time_ns = samples.tick * 1_000_000
    samples.scene = 1
    samples.device_force_n = (1.0, -1.0, np.sqrt(2.0))
    samples.wake_mps = (0.2, 0.0, 0.1)
    samples.limiters = LIMITER_NORM
    return samples


@pytest.fixture(params=[None, 6.0], ids=["double", "single"])
def window(request: pytest.FixtureRequest, qtbot: Any) -> Iterator[OperatorWindow]:
    made = OperatorWindow("demo", lateness_limit_s=0.002, reach_m=0.05, pointer=False, force_limit_n=request.param)
    qtbot.addWidget(made)
    made.show()
    qtbot.waitExposed(made)
    yield made
    made.may_close = True
    made.close()


def settle(window: OperatorWindow, size: tuple[int, int]) -> None:
    window.resize(*size)
    for _ in range(3):
        QApplication.processEvents()


def filled(window: OperatorWindow, told: Any, health: Any, state: Callable[[Any], dict[str, Any]]) -> None:
    said = state(told)
    forces = Forces(6.0)
    forces.take(pushes())
    blinding = "double" if not isinstance(window.force, ForceCard) else "single"
    study = told.session.protocol.study.model_copy(update={"blinding": blinding})
    told.session = told.session.__class__(
        **{name: getattr(told.session, name) for name in told.session.__dataclass_fields__}
        | {"protocol": told.session.protocol.model_copy(update={"study": study})}
    )
    view = told.view(health, forces=forces.figures() if blinding == "single" else None, **said)
    if state is trouble:
        line = "Not connected: the Falcon was not homed: no arm found its index: push the grip all the way in once."
        view = replace(view, may_reconnect=True, reconnection=line)
    for _ in range(2):
        window.show_view(view)
        window.show_traces(health, 4.0)
        window.show_lateness(health)
        window.show_forces(forces, 4_000_000_000)


def scrolls(widget: QWidget, window: QWidget) -> bool:
    """Whether a part of the window that may scroll holds ``widget``."""
    parent = widget.parentWidget()
    while parent is not None and parent is not window:
        if isinstance(parent, QAbstractScrollArea):
            return True
        parent = parent.parentWidget()
    return False


def cut(window: OperatorWindow) -> list[str]:
    """Return what cannot be read whole: words without room, or beyond the window or their parent."""
    found = []
    for widget in window.findChildren(QWidget):
        if not widget.isVisible() or not isinstance(widget, QLabel | QPushButton):
            continue
        words = widget.accessibleName() or widget.text()
        place = QRect(widget.mapTo(window, widget.rect().topLeft()), widget.size())
        inside = window.rect().contains(place)
        across = place.left() >= 0 and place.right() <= window.width()
        if not (across if scrolls(widget, window) else inside):
            found.append(f"{words}: outside")
        parent = widget.parentWidget()
        if parent is not None and not parent.rect().adjusted(-1, -1, 1, 1).contains(widget.geometry()):
            found.append(f"{words}: beyond its parent")
        if isinstance(widget, ActionButton) and widget.width() < widget.minimumSizeHint().width():
            found.append(f"{words}: {widget.width()} px for {widget.minimumSizeHint().width()}")
        if isinstance(widget, QLabel) and not isinstance(widget, Elided):
            metrics = widget.fontMetrics()
            if widget.wordWrap() and widget.height() < widget.heightForWidth(widget.width()):
                found.append(f"{words}: too low")
            if not widget.wordWrap() and widget.width() < max(
                map(metrics.horizontalAdvance, widget.text().split("\n"))
            ):
                found.append(f"{words}: too narrow")
            if widget.text() and widget.height() < metrics.height():
                found.append(f"{words}: lower than a line")
    return found


def beyond_the_plot(window: OperatorWindow) -> list[str]:
    """Return the names of curves that do not stand whole in their plot."""
    plots = [window.position.plot] + ([window.force.plot] if isinstance(window.force, ForceCard) else [])
    found = []
    for plot in plots:
        plot.grab()  # names take their places when they are painted
        box = plot.box.mapRectToScene(plot.box.boundingRect()).adjusted(-1, -2, 1, 2)
        found += [
            end.textItem.toPlainText()
            for end in plot.ends
            if end.isVisible() and not box.contains(end.textItem.mapRectToScene(end.textItem.boundingRect()))
        ]
    return found


@pytest.mark.variants(5)
@pytest.mark.parametrize("state", STATES, ids=lambda state: state.__name__)
def test_nothing_is_clipped(window: OperatorWindow, told: Any, health: Any, state: Any) -> None:
    filled(window, told, health, state)
    problems = {}
    for size in SIZES if state is running else FEW:
        settle(window, size)
        assert (window.width(), window.height()) == size
        problems[size] = cut(window) + beyond_the_plot(window)
        assert window.arrangement.side_area.verticalScrollBar().maximum() == 0, size
        stop = window.stop.stop
        assert stop.width() >= LEAST_WIDTH
        assert stop.height() >= LEAST_HEIGHT
        assert window.rect().contains(QRect(stop.mapTo(window, stop.rect().topLeft()), stop.size()))
        assert not scrolls(stop, window)
    assert {size: found for size, found in problems.items() if found} == {}


def test_the_shape_of_the_window_does_not_tell_whether_the_force_is_hidden(qtbot: Any, told: Any, health: Any) -> None:
    places = []
    for limit_n in (None, 6.0):
        window = OperatorWindow("demo", lateness_limit_s=0.002, reach_m=0.05, pointer=False, force_limit_n=limit_n)
        qtbot.addWidget(window)
        window.show()
        filled(window, told, health, preparing)
        here = []
        for size in FEW:
            settle(window, size)
            parts = (window.force, window.lateness, window.position, window.device, window.notes, window.stop)
            here += [(part.mapTo(window, part.rect().topLeft()), part.size()) for part in parts]
        places.append(here)
        window.may_close = True
    assert places[0] == places[1]
