"""Keyboard commands: their keys, tips and actions, from one table."""

from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget

from study_app.gui.kit.commands import (
    Command,
    add_commands,
    command_tip,
    connect_button,
    key_cap,
    keys_markdown,
    keys_of,
    with_key,
)
from study_app.gui.widgets.boxes import vbox
from study_app.gui.widgets.controls import ActionButton


def test_keys_are_named_as_on_a_keyboard() -> None:
    assert (key_cap("duplicate"), key_cap("redo"), key_cap("leave page")) == ("Ctrl D", "Ctrl Shift Z", "Esc")
    assert keys_of("redo") == ("Ctrl+Shift+Z", "Ctrl+Y")
    assert (command_tip("open"), with_key("Open it", "open")) == ("Open file… (Ctrl+O)", "Open it (Ctrl+O)")
    assert Command("a", "A", ("Escape", "Ctrl+Return"), held=True).key_labels == ("hold Esc", "hold Ctrl+Enter")
    rows = keys_markdown().splitlines()
    assert rows[:2] == ["| key | action |", "| --- | --- |"]
    for row in (
        "| Ctrl+Shift+Z, Ctrl+Y | Redo |",
        "| Del | Delete (outline, lists) |",
        "| hold Esc | Stop playing (during playback) |",
    ):
        assert row in rows


def test_keys_and_the_button_of_a_command_run_it_while_it_is_enabled(qtbot: Any) -> None:
    window, run = QWidget(), list[str]()
    qtbot.addWidget(window)
    button = ActionButton("", "Undo")
    vbox(button, parent=window)
    actions = add_commands(window, {"undo": lambda: run.append("undo"), "redo": lambda: run.append("redo")})
    connect_button(button, actions["undo"])
    window.show()
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow)
    assert (actions["undo"].text(), actions["undo"].toolTip(), button.toolTip()) == (
        "Undo", "Undo (Ctrl+Z)", "Undo (Ctrl+Z)"
    )  # fmt: skip
    control = Qt.KeyboardModifier.ControlModifier
    for key, modifiers in ((Qt.Key.Key_Z, control), (Qt.Key.Key_Y, control)):
        qtbot.keyClick(window, key, modifiers)
    qtbot.keyClick(window, Qt.Key.Key_Z, control | Qt.KeyboardModifier.ShiftModifier)
    button.click()
    assert run == ["undo", "redo", "redo", "undo"]
    actions["undo"].setEnabled(False)
    qtbot.keyClick(window, Qt.Key.Key_Z, control)
    assert (button.isEnabled(), len(run)) == (False, 4)
