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


def run(told: Any) -> None:
    told.welcome()
    told.start(1)
    for text in ("Right-handed, no glasses.", "Adjusted the chair, elbow supported, asked twice whether all is well"):
        told.tell("note", 5.0, kind="note", text=text)
    told.end(1, worst_gap_ms=31.0)
    told.answer(1)
    told.start(2)


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
    made = OperatorWindow("demo", lateness_limit_s=0.002, reach_m=0.05, pointer=False, force_limit_n=request.param)
    qtbot.addWidget(made)
    made.header.page.show()  # as on one screen, where the header has least room
    made.show()
    qtbot.waitExposed(made)
    yield made
    made.may_close = True
    made.close()


def filled(window: OperatorWindow, told: Any, health: Any, state: str) -> None:
    happened, said = STATES[state]
    if state != "preparing":
        run(told)
    for event, fields in happened.items():
        told.tell(event, **fields)
    forces = Forces(6.0)
    forces.add_samples(pushes())
    if single := hasattr(window.force, "plot"):
        told.make_single_blind()
    view = told.view(health, forces=forces.figures() if single else None, **said)
    if state == "trouble":
        view = replace(view, may_reconnect=True, reconnection=UNCONNECTED)
    for _ in range(2):
        window.show_view(view)
        window.show_traces(health, 4.0)
        window.show_lateness(health)
        window.show_forces(forces, 4_000_000_000)


def beyond_the_plot(window: OperatorWindow) -> list[str]:
    """Return the names of curves that do not stand whole in their plot."""
    found = []
    for plot in (card.plot for card in (window.position, window.force) if hasattr(card, "plot")):
        plot.grab()  # names take their places when they are painted
        box = plot.box.mapRectToScene(plot.box.boundingRect()).adjusted(-1, -2, 1, 2)
        found += [
            end.textItem.toPlainText()
            for end in plot.ends
            if end.isVisible() and not box.contains(end.textItem.mapRectToScene(end.textItem.boundingRect()))
        ]
    return found


@pytest.mark.variants(5)
@pytest.mark.parametrize("state", STATES)
def test_nothing_is_clipped(window: OperatorWindow, told: Any, health: Any, state: str) -> None:
    filled(window, told, health, state)
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
    assert {size: found for size, found in problems.items() if found} == {}
    assert unnamed(window) + dead(window) == []


def test_the_shape_of_the_window_does_not_tell_whether_the_force_is_hidden(qtbot: Any, told: Any, health: Any) -> None:
    places = []
    for limit_n in (None, 6.0):
        window = OperatorWindow("demo", lateness_limit_s=0.002, reach_m=0.05, pointer=False, force_limit_n=limit_n)
        qtbot.addWidget(window)
        window.show()
        filled(window, told, health, "preparing")
        here = []
        for size in FEW:
            settle(window, size)
            parts = (window.force, window.lateness, window.position, window.device, window.notes, window.stop)
            here += [(part.mapTo(window, part.rect().topLeft()), part.size()) for part in parts]
        places.append(here)
        window.may_close = True
    assert places[0] == places[1]
