"""The machine's place: the display test, and what is typed."""

from dataclasses import replace

import pytest
from PySide6.QtCore import Qt

from study_app.gui.settings import view
from study_app.store.workstation import DisplayOffset, MachineSettings
from tests.gui.windows import SCREENS, machine, show_settings


@pytest.fixture
def real_place(qtbot):
    made = machine(qtbot)
    yield made
    made.leave()


def test_the_display_test_is_opened_once_and_left_by_esc(real_place, qtbot):
    qtbot.mouseClick(real_place.screens.test, Qt.MouseButton.LeftButton)
    test = real_place.test
    assert test.isVisible()
    assert [value.accessibleName() for value in test.values] == list(view._NAMES)
    assert test.interval.field.unit == "ms"
    real_place.open_test()
    assert real_place.test is test
    with qtbot.waitSignal(test.left):
        qtbot.keyClick(test, Qt.Key.Key_Escape)
    assert real_place.test is None


def test_what_is_being_typed_stays_if_something_else_is_set(real_place, qtbot):
    camera = real_place.editors["camera"].control
    qtbot.keyClicks(camera, "v4l2:/dev/vid")
    show_settings(real_place, MachineSettings(theme="dark", camera="tcp://127.0.0.1:5000"))
    assert camera.text() == "v4l2:/dev/vid"
    qtbot.keyClick(camera, Qt.Key.Key_Escape)
    assert camera.text() == "tcp://127.0.0.1:5000"


def test_a_screen_without_a_reported_width_is_described(real_place, monkeypatch):
    monkeypatch.setattr(view, "screens_shown", lambda: (replace(SCREENS[0], width_mm=0.0),))
    show_settings(real_place, MachineSettings())
    assert real_place.editors["screen_width_mm"].below.text() == "The system does not report the width."


@pytest.mark.parametrize(
    ("name", "good", "bad"), [("proofs", ".", "nowhere"), ("stamps", "https://a.b/c", "a.b"), ("stamp_root", ".", "x")]
)
def test_where_proofs_go_is_set_and_taken_back_here(real_place, qtbot, tmp_path, monkeypatch, name, good, bad):
    monkeypatch.chdir(tmp_path)
    editor = real_place.editors[name]
    for typed, value in ((good, good), ("", MachineSettings.model_fields[name].default)):
        editor.control.selectAll()
        with qtbot.waitSignal(real_place.changed) as heard:
            qtbot.keyClicks(editor.control, typed) if typed else qtbot.keyClick(editor.control, Qt.Key.Key_Delete)
            qtbot.keyClick(editor.control, Qt.Key.Key_Return)
        assert heard.args == [{name: value}]
        show_settings(real_place, MachineSettings.model_validate({name: value}))
        assert editor.control.text() == typed
    with qtbot.assertNotEmitted(real_place.changed):
        qtbot.keyClicks(editor.control, bad)
        qtbot.keyClick(editor.control, Qt.Key.Key_Return)
    assert "eave" in editor.below.text()


@pytest.mark.parametrize(
    ("screen", "ending"),
    [("Mine", ")."), ("Other", "). It was measured on another screen (Other) and is not used here.")],
)
def test_the_display_offset_is_shown_with_its_screen_and_handed_on_as_it_was_typed(real_place, qtbot, screen, ending):
    form, kept = real_place.offset, []
    form.kept.connect(lambda *values: kept.append(values))
    form.show_offset(None, "Mine")
    assert (form.forget.isEnabled(), form.said.text().startswith("Not measured.")) == (False, True)
    offset = DisplayOffset(mean_ms=23.5, spread_ms=1.25, how="data sheet", measured="2026-11-20", screen=screen)
    form.show_offset(offset, "Mine")
    assert form.forget.isEnabled()
    assert form.said.text() == f"23.5 ± 1.25 ms (data sheet, 2026-11-20{ending}"
    form.editors["mean"].control.setText("17.25")
    form.keep.click()
    form.editors["spread"].control.setText("")
    form.keep.click()
    form.editors["mean"].control.setText("twelve")
    form.keep.click()
    assert kept == [(17.25, 1.25, "data sheet"), (17.25, 0.0, "data sheet")]
    with qtbot.waitSignal(form.forgotten):
        form.forget.click()
