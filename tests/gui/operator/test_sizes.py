"""Nothing is clipped at any size, and the force stop neither moves, shrinks nor scrolls."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from study_app.gui.operator.servo_health import Forces
from study_app.gui.operator.window import OperatorWindow
from study_app.haptics.model.layout import LIMITER_NORM, SAMPLE, records
from tests.gui.walk import cut, dead, place_of, scrolls, settle, unnamed

pytestmark = pytest.mark.slow

SIZES = ((1024, 640), (1250, 705), (1366, 768), (1499, 869), (1600, 750), (1920, 1080))
FEW = ((1024, 640), (1366, 768), (1600, 900))


BROKEN = (
    "the device 'falcon' stopped responding or lost its guard process; turn it off if it is still pushing, and "
    "reconnect it"
)
UNCONNECTED = "Not connected: the Falcon was not homed: no arm found its index: push the grip all the way in once."
STATES: dict[str, tuple[dict[str, dict[str, Any]], dict[str, Any]]] = {
    # what happens to a session that runs, and what else the view says
    "preparing": ({}, {}),
    "running": ({}, {}),
    "paused": ({"paused": {"by": "operator"}}, {}),
    "force off": ({"force_stopped": {"by": "operator"}, "paused": {"by": "operator"}}, {"force_on": False}),
    "trouble": ({"broke": {"what": BROKEN}}, {"force_on": False, "device_ready": False, "faults": 2}),
    "waiting": ({}, {"force_on": False, "trouble": "no space left on the disk: free some", "waits": True}),
    "ended": (
        {"session_ended": {"status": "broken", "reason": "", "fingerprint": "wwww-mmmm-wwww"}},
        {"force_on": False},
    ),
}


def run(demo_session: Any) -> None:
    demo_session.welcome()
    demo_session.start(1)
    for text in ("Right-handed, no glasses.", "Adjusted the chair, elbow supported, asked twice whether all is well"):
        demo_session.tell("note", 5.0, kind="note", text=text)
    demo_session.end(1, worst_gap_ms=31.0)
    demo_session.answer(1)
    demo_session.start(2)


def pushes() -> Any:
    """Return samples of a hand that is pushed by 2 N, and limited often."""
    samples = records(SAMPLE, 4000)
    samples.tick = np.arange(4000)
    samples.time_ns = samples.tick * 1_000_000
    samples.scene = 1
    samples.device_force_n = (1.0, -1.0, np.sqrt(2.0))
    samples.limiters = LIMITER_NORM
    return samples


@pytest.fixture(params=[None, 6.0], ids=["double", "single"])
def window(request: pytest.FixtureRequest, qtbot: Any) -> Iterator[OperatorWindow]:
    operator_window = OperatorWindow(
        "demo", lateness_limit_s=0.002, reach_m=0.05, pointer=False, force_limit_n=request.param
    )
    qtbot.addWidget(operator_window)
    operator_window.header.page.show()  # as on one screen, where the header has least room
    operator_window.show()
    qtbot.waitExposed(operator_window)
    yield operator_window
    operator_window.may_close = True
    operator_window.close()


def fill_window(window: OperatorWindow, demo_session: Any, health: Any, state: str) -> None:
    happened, said = STATES[state]
    if state != "preparing":
        run(demo_session)
    for event, fields in happened.items():
        demo_session.tell(event, **fields)
    forces = Forces(6.0)
    forces.add_samples(pushes())
    if single := hasattr(window.force, "plot"):
        demo_session.make_single_blind()
    view = demo_session.view(health, forces=forces.figures() if single else None, **said)
    if state == "trouble":
        view = replace(view, may_reconnect=True, reconnection=UNCONNECTED)
    for _ in range(2):
        window.show_view(view)
        window.show_traces(health, 4.0)
        window.show_lateness(health)
        window.show_forces(forces, 4_000_000_000)


def beyond_the_plot(window: OperatorWindow) -> list[str]:
    """Return the names of curves whose labels are not fully inside their plot."""
    names = []
    for plot in (card.plot for card in (window.position, window.force) if hasattr(card, "plot")):
        plot.grab()  # names take their places when they are painted
        box = plot.box.mapRectToScene(plot.box.boundingRect()).adjusted(-1, -2, 1, 2)
        names += [
            end.textItem.toPlainText()
            for end in plot.ends
            if end.isVisible() and not box.contains(end.textItem.mapRectToScene(end.textItem.boundingRect()))
        ]
    return names


@pytest.mark.variants(5)
@pytest.mark.parametrize("state", STATES)
def test_nothing_is_clipped(window: OperatorWindow, demo_session: Any, health: Any, state: str) -> None:
    fill_window(window, demo_session, health, state)
    problems = {}
    for size in SIZES if state == "running" else FEW:
        settle(window, size)
        assert (window.width(), window.height()) == size
        problems[size] = cut(window) + beyond_the_plot(window)
        assert window.arrangement.side_area.verticalScrollBar().maximum() == 0, size
        assert window.header.study.text() == "demo", size
        stop = window.stop.stop
        assert stop.width() >= 320
        assert stop.height() >= 160
        assert window.rect().contains(place_of(stop, window))
        assert not scrolls(stop, window)
    assert {size: clipped for size, clipped in problems.items() if clipped} == {}
    assert unnamed(window) + dead(window) == []


def test_the_shape_of_the_window_does_not_tell_whether_the_force_is_hidden(
    qtbot: Any, demo_session: Any, health: Any
) -> None:
    places = []
    for limit_n in (None, 6.0):
        window = OperatorWindow("demo", lateness_limit_s=0.002, reach_m=0.05, pointer=False, force_limit_n=limit_n)
        qtbot.addWidget(window)
        window.show()
        fill_window(window, demo_session, health, "preparing")
        here = []
        for size in FEW:
            settle(window, size)
            parts = (window.force, window.lateness, window.position, window.device, window.notes, window.stop)
            here += [(part.mapTo(window, part.rect().topLeft()), part.size()) for part in parts]
        places.append(here)
        window.may_close = True
    assert places[0] == places[1]


COLUMNS: dict[int, dict[str, Any]] = {
    # by the width of the window [px]: left edges and widths [px], the plots in a row, and the width of an icon [px]
    1066: {"rail": (9, 72), "middle": (90, 608), "bar": (9, 689), "plots": 1, "icon": 0},
    1067: {"rail": (9, 72), "middle": (90, 609), "bar": (9, 690), "plots": 1, "icon": 28},
    1097: {"rail": (9, 72), "middle": (90, 639), "bar": (9, 720), "plots": 1, "icon": 28},
    1098: {"rail": (9, 72), "middle": (90, 640), "bar": (9, 721), "plots": 2, "icon": 28},
    1319: {"rail": (9, 72), "middle": (90, 861), "bar": (9, 942), "plots": 2, "icon": 28},
    1320: {"rail": (18, 248), "middle": (280, 658), "bar": (280, 658), "plots": 2, "icon": 0},
    1351: {"rail": (18, 248), "middle": (280, 689), "bar": (280, 689), "plots": 2, "icon": 0},
    1352: {"rail": (18, 248), "middle": (280, 690), "bar": (280, 690), "plots": 2, "icon": 28},
    1499: {"rail": (18, 248), "middle": (280, 837), "bar": (280, 837), "plots": 2, "icon": 28},
    1500: {"rail": (21, 318), "middle": (357, 754), "bar": (357, 754), "plots": 2, "icon": 28},
}


def test_each_width_of_the_window_has_its_columns_plots_and_icons(window: OperatorWindow, demo_session: Any) -> None:
    window.show_view(demo_session.view())
    settle(window, (1066, 768))
    buttons = {button: button.sizeHint().width() for button in (window.buttons.pause, window.buttons.end)}
    parts = {"rail": window.rail, "middle": window.arrangement.middle_area, "bar": window.buttons}
    for width in (*COLUMNS, 1066):
        settle(window, (width, 768))
        places = {name: place_of(part, window) for name, part in parts.items()}
        side, lateness, force = (
            place_of(part, window) for part in (window.arrangement.side_area, window.lateness, window.force)
        )
        (icon,) = {button.sizeHint().width() - text_width for button, text_width in buttons.items()}
        plots = 2 if force.y() == lateness.y() else 1
        columns = {name: (place.x(), place.width()) for name, place in places.items()}
        assert columns | {"plots": plots, "icon": icon} == COLUMNS[width], width
        assert len({place_of(tile, window).y() for tile in window.tiles.cards}) == (1 if plots == 2 else 2), width
        assert (side.width(), width - side.x() - 350) == (350, places["rail"].x()), width
        assert window.buttons.hint.isVisible() == (width >= 1500)
        assert window.header.bar.isVisible() == window.header.trials.isVisible() == (width >= 1320)
        assert window.arrangement.now.isVisible() == (width < 1320)


@pytest.mark.parametrize(
    ("height", "stop_px", "notes", "rows"),
    [(870, 250, 3, 5), (869, 236, 2, 3), (750, 236, 2, 3), (749, 236, 1, 2), (705, 236, 1, 2), (704, 236, 0, 2)],
)
def test_each_height_of_the_window_has_its_stop_notes_and_rows_of_the_device(
    window: OperatorWindow, demo_session: Any, height: int, stop_px: int, notes: int, rows: int
) -> None:
    for text in ("First", "Second", "Third", "Fourth"):
        demo_session.tell("note", 5.0, kind="note", text=text)
    view = demo_session.view()
    values = ["real-time", "1000 Hz", "0", "8 N", "falcon"]
    device = replace(view.device, rows=tuple((f"Property {number}", value) for number, value in enumerate(values)))
    window.show_view(replace(view, device=device))
    settle(window, (1366, height))
    assert (window.stop.width(), window.stop.height()) == (350, stop_px)
    shown_notes = [line.text.whole for line in window.notes.lines if line.isVisible()]
    assert shown_notes == ["Fourth", "Third", "Second"][:notes]
    assert window.notes.hint.isVisible() == (notes == 3)
    assert [value.whole for _, value in window.device.rows if value.isVisible()] == values[:rows]
