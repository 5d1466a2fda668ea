"""The liquid lab in its states: moved, blind, measuring, refused."""

import dataclasses
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from PySide6.QtCore import QPoint, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QWidget

from study_app.gui.lab.lab_state import Now
from study_app.gui.theme.theme import DARK
from study_app.gui.theme.themed import apply_theme
from study_app.lab.ab_comparison import Setting, Workbench
from study_app.lab.presets import displayed_name
from study_app.lab.shadow import Trace
from study_app.protocol.load import load_scene
from tests.gui.lab.sample import blind, still_view, workbench
from tests.gui.transcript import Actions, clicked, in_turn


def made_up_motion() -> dict[str, Any]:
    """Return a motion of both sides, made up: a zigzag with three segments and two oscillating forces."""
    count = 300
    share = np.linspace(0.0, 1.0, count)
    places = np.column_stack((0.04 * np.sin(9 * share), 0.02 * np.cos(7 * share), 0.025 * share - 0.01))
    breaks = np.isin(np.arange(count), (0, 120, 230))
    tail = SimpleNamespace(positions_m=places, breaks=breaks, ages=1 - share, elements=1700, alive=1210, segments=3)
    t_s = np.linspace(-2.5, 0.0, 2500)
    wave = np.column_stack((np.sin(5 * t_s), np.cos(3 * t_s), 0.2 * t_s))
    body_mps, wake_a_mps, wake_b_mps = (0.2 + 0.1 * np.sin(k * t_s) for k in (2, 3, 4))
    acting = still_view().limiters
    return {
        "trace": Trace(
            t_s=t_s,
            force_a_n=3 * wave,
            force_b_n=2 * wave[::-1],
            body_mps=body_mps,
            wake_a_mps=wake_a_mps,
            wake_b_mps=wake_b_mps,
            presented_a=t_s < -1.0,
        ),
        "tail_a": tail,
        "tail_b": replace_fields(tail, positions_m=-places, segments=1, breaks=breaks & (share < 0.1)),
        "now": Now(position_m=(0.01, 0.005, 0.004), force_n=(2.0, 1.0, 0.5), wake_mps=(0.3, -0.2, 0.1)),
        "limiters": (
            dataclasses.replace(acting[0], ticks=14, acting=True),
            dataclasses.replace(acting[1], ticks=1500),
            *acting[2:],
        ),
    }


def replace_fields(kept: SimpleNamespace, **changed: Any) -> SimpleNamespace:
    return SimpleNamespace(**(vars(kept) | changed))


def slime(a: str, b: str) -> Workbench:
    scenes = {name: load_scene("slime", name) for name in (a, b)}
    return Workbench(*(Setting(displayed_name(name), scenes[name], scenes[name]) for name in (a, b)))


def of_lab(**fields: Any) -> Callable[[Any], None]:
    return lambda place: place.show_view(still_view(**fields))


def shown_now(place: QWidget) -> None:
    """Run the pending single-shot timers at once."""
    for timer in place.findChildren(QTimer):
        if timer.isSingleShot() and timer.isActive():
            timer.start(0)


def refused(place: Any) -> None:
    """Type an invalid number, and a length that the model refuses."""
    for name, text in (("wake.exponent", "0.5.5"), ("wake.length", "9000")):
        field = place.form.rows[name].field
        field.selectAll()
        QTest.keyClicks(field, text)
        QTest.keyClick(field, "\r")
    place.show_view(still_view(refused=("wake.length", "length 9000 exceeds scaling 2600: lower length")))


def left_by_escape(place: Any) -> None:
    """Press Esc in the field of a length that the model refuses."""
    row = place.form.rows["wake.length"]
    row.slider.setValue(row.slider.maximum())
    place.show_view(still_view(refused=("wake.length", "too long")))
    row.field.setFocus()
    QTest.keyClick(row.field, "\x1b")


def held_over_a_switch(place: Any) -> None:
    """Switch sides while a knob is held, and move it on."""
    place.show_view(still_view())
    slider = place.form.rows["wake.length"].slider
    QTest.mousePress(slider, Qt.MouseButton.LeftButton, pos=QPoint(30, 16))
    place.show_view(still_view(workbench().switch()))
    QTest.mouseMove(slider, QPoint(50, 16))
    QTest.mouseRelease(slider, Qt.MouseButton.LeftButton, pos=QPoint(50, 16))


LAB: Actions = {
    "moved": lambda place: place.show_view(still_view(**made_up_motion())),
    "B felt": lambda place: place.show_view(still_view(workbench().switch(), **made_up_motion())),
    "blind": lambda place: place.show_view(still_view(blind(workbench(), first="B"), **made_up_motion())),
    "measuring": of_lab(cost=(), errors=(), tick_ns=None, measuring=True),
    "not measured": of_lab(cost=(), errors=()),
    "refused": refused,
    "Esc leaves what was refused": left_by_escape,
    "a knob held over a switch": held_over_a_switch,
    "other force limit": lambda place: place.show_view(
        still_view(slime("ketchup", "honey").change("scene.force_limit_n", 4.0), study="own")
    ),
    "busy": lambda place: (of_lab(busy="Opening the Falcon")(place), shown_now(place)),
    "trouble": in_turn(clicked("note.cancel"), of_lab(trouble="No Falcon answers: check its cable.")),
    "put away": in_turn(clicked("note.dismiss"), of_lab(trouble="No Falcon answers: check its cable.", said="Saved")),
    "another trouble": of_lab(trouble="The Falcon stopped."),
    "force off": of_lab(force_on=False, said="Saved as syrup.toml"),
    "path": in_turn(clicked("note.fade_in"), of_lab(path="zigzag", study="own.toml")),
    "undone": lambda place: place.show_view(still_view(workbench().undo())),
    "narrow": lambda place: place.resize(928, 640),
    "dark": lambda place: apply_theme(place, DARK),
}
