"""The settings page of the machine: the display test and typed values."""

from dataclasses import replace

import pytest
from PySide6.QtCore import QEvent, Qt, QTimer
from PySide6.QtWidgets import QApplication, QBoxLayout, QFileDialog, QLabel
from shiboken6 import isValid

from study_app.gui.settings import view
from study_app.gui.widgets.labels import Elided
from study_app.store.workstation import DisplayOffset, MachineSettings
from tests.gui.windows import SCREENS, machine, show_settings, two_screens


@pytest.fixture
def real_place(qtbot):
    place = machine(qtbot)
    yield place
    place.leave()


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
    real_place.open_test()
    again = real_place.test
    real_place.leave()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    assert (real_place.test, isValid(again)) == (None, False)


@pytest.mark.slow
def test_the_display_test_is_for_the_participants_screen_if_that_is_connected(real_place, monkeypatch):
    monkeypatch.setattr(view, "screens_shown", lambda: (replace(SCREENS[0], refresh_hz=75.0), SCREENS[1]))
    show_settings(real_place, MachineSettings(screen="DP-1"))
    real_place.open_test()
    assert real_place.test is None, "this computer has one screen"
    show_settings(real_place, MachineSettings(screen="eDP-1"))
    real_place.open_test()
    texts = [part.text() for part in real_place.test.findChildren(QLabel)]
    assert "Screen 1  ·  eDP-1  ·  1366 × 768, 75 Hz, 100\u202f%" in texts
    assert (real_place.test.times.refresh_hz, real_place.test.isFullScreen()) == (75.0, True)
    assert (real_place.test.interval.value, real_place.test.frames.period_ns) == (500.0, round(1e9 / 75))
    assert [real_place.test.frames.findChild(QTimer).isActive(), real_place.test.report_timer.isActive()] == [True] * 2
    real_place.test.leave.click()
    assert real_place.test is None


@pytest.mark.slow
def test_one_of_the_screens_is_the_participants(real_place, qtbot, monkeypatch):
    two_screens(monkeypatch)
    real_place.enter()
    card = real_place.screens
    radios = card.radios
    names = [radio.accessibleName() for radio in radios]
    assert names == [f"Screen 1, eDP-1, {SCREENS[0].words}", f"Screen 2, DP-1, {SCREENS[1].words}"]
    texts = [part.text() for part in card.findChildren(QLabel)]
    assert {f"{SCREENS[0].words}  ·  344 × 194 mm", f"{SCREENS[1].words}  ·  527 × 296 mm"} <= {*texts}
    assert [part.whole for part in card.findChildren(Elided)] == ["eDP-1", "DP-1"]
    for name, checked, note in (
        ("eDP-1", [True, False], ""),
        ("HDMI-1", [False, True], "HDMI-1 is not connected, so the last screen in the list is used instead."),
        ("", [False, True], ""),
    ):
        show_settings(real_place, MachineSettings(screen=name))
        assert [radio.isChecked() for radio in radios] == checked
        assert (card.note.text(), card.note.isHidden()) == (note, not note)
    assert card.radios is radios
    with qtbot.waitSignal(real_place.changed) as heard:
        radios[0].click()
    assert heard.args == [{"screen": "eDP-1", "screen_number": 1}]
    monkeypatch.setattr(view, "screens_shown", lambda: (replace(SCREENS[0], width_mm=0.0),))
    real_place.enter()
    assert [radio.accessibleName() for radio in card.radios] == names[:1]
    qtbot.waitUntil(lambda: f"{SCREENS[0].words}  ·  size unknown" in [it.text() for it in card.findChildren(QLabel)])


@pytest.mark.slow
def test_each_field_shows_its_setting_and_hands_on_a_new_one(real_place, qtbot, tmp_path):
    settings = MachineSettings(
        viewing_distance_mm=600.0, screen_width_mm=500.0, lsl_markers=True, lsl_samples="always",
        triggers="serial:COM3", photodiode=False, device="falcon:FT1", camera="v4l2:/dev/video7", proofs=str(tmp_path),
        stamps="https://a.b/c", stamp_root=str(tmp_path.parent), theme="dark", sound=True,
    )  # fmt: skip
    show_settings(real_place, settings, undo="the width")
    values = {name: editor.value for name, editor in real_place.editors.items()}
    assert real_place.editors["device"].isAncestorOf(real_place.devices)
    assert all(real_place.isAncestorOf(editor) for editor in real_place.editors.values())
    assert values == {name: getattr(settings, name) for name in values} | {"device": "falcon"}
    assert (real_place.undo.text(), real_place.undo.isEnabled()) == ("Undo the width", True)
    assert (real_place.folder.whole, real_place.kept_in.whole) == ("/there", "Saved in /there/machine.json")
    for name, value in (("photodiode", True), ("lsl_markers", False), ("sound", False)):
        with qtbot.waitSignal(real_place.changed) as heard:
            real_place.editors[name].control.click()
        assert heard.args == [{name: value}]
    for name, refused in (("triggers", "COM3"), ("viewing_distance_mm", "199"), ("screen_width_mm", "5001")):
        real_place.editors[name].control.selectAll()
        with qtbot.assertNotEmitted(real_place.changed):
            qtbot.keyClicks(real_place.editors[name].control, refused)
            qtbot.keyClick(real_place.editors[name].control, Qt.Key.Key_Return)
    assert real_place.offset.said.text().startswith("Not measured.")
    offset = DisplayOffset(mean_ms=23.5, screen=real_place.participants.name)
    show_settings(real_place, settings.model_copy(update={"display_offset": offset}))
    assert real_place.offset.said.text() == "23.5 ± 0 ms (photodiode)."
    assert (real_place.undo.text(), real_place.undo.isEnabled()) == ("Undo", False)


@pytest.mark.slow
def test_each_button_sends_its_request(real_place, qtbot, monkeypatch):
    two_screens(monkeypatch)
    show_settings(real_place, MachineSettings(), undo="the width")
    dialogs, chosen = [], iter(["", "/new"])
    monkeypatch.setattr(
        QFileDialog, "getExistingDirectory", lambda *arguments: dialogs.append(arguments) or next(chosen)
    )
    with qtbot.assertNotEmitted(real_place.changed):
        real_place.change.click()
    for signal, act, said in (
        (real_place.go_asked, real_place.devices.click, ["devices"]),
        (real_place.changed, real_place.change.click, [{"workspace": "/new"}]),
        (real_place.undo_asked, real_place.undo.click, []),
        (real_place.undo_asked, lambda: qtbot.keyClick(real_place, "z", Qt.KeyboardModifier.ControlModifier), []),
        (real_place.check_asked, real_place.check.click, []),
        (real_place.changed, real_place.offset.forgotten.emit, [{"display_offset": None}]),
        (
            real_place.offset_measured,
            lambda: real_place.offset.kept.emit(1.5, 0.25, "data sheet"),
            [1.5, 0.25, "data sheet", "DP-1"],
        ),
    ):
        with qtbot.waitSignal(signal) as heard:
            act()
        assert heard.args == said
    assert dialogs == [(real_place, "Workspace", "/there")] * 2


@pytest.mark.slow
def test_the_columns_are_side_by_side_where_they_fit(real_place):
    beside, below = QBoxLayout.Direction.LeftToRight, QBoxLayout.Direction.TopToBottom
    for width, direction in ((1300, beside), (999, below), (1000, beside)):
        real_place.resize(width, 760)
        assert real_place._body.direction() == direction


@pytest.mark.slow
@pytest.mark.parametrize(
    ("screen", "distance_mm", "width_mm", "scale", "sentence"),
    [  # an x of 8.73 px
        ("eDP-1", None, None, 1.0, "Measure the viewing distance; text is then enlarged until the letter x subtends"),
        ("eDP-1", 600.0, None, 1.9044, "1.90 times the default size: the letter x subtends 0.4° instead of 0.21°."),
        ("DP-1", 600.0, None, 1.7473, "1.75 times the default size: the letter x subtends 0.4° instead of 0.23°."),
        ("DP-1", 300.0, None, 1.0, "Default size: the letter x subtends 0.46°; at least 0.4° is recommended."),
        ("DP-1", 600.0, 400.0, 2.302, "2.30 times the default size: the letter x subtends 0.4° instead of 0.17°."),
        ("DP-1", 3000.0, None, 2.4, "8.74 times the default size: the letter x subtends 0.4° instead of 0.05°."),
    ],
)
def test_a_sample_has_the_size_that_participants_see(
    real_place, monkeypatch, screen, distance_mm, width_mm, scale, sentence
):
    two_screens(monkeypatch)
    default_px = real_place.sample.font().pixelSize()
    settings = MachineSettings(screen=screen, viewing_distance_mm=distance_mm, screen_width_mm=width_mm)
    show_settings(real_place, settings)
    assert real_place.said.text().startswith(sentence)
    assert real_place.sample.font().pixelSize() == pytest.approx(scale * default_px, abs=1)
    reported = f"The system reports {344 if screen == 'eDP-1' else 527} mm."
    used = "" if width_mm is None else " The measured value is used instead."
    assert real_place.editors["screen_width_mm"].below.text() == reported + used


def test_typing_stays_while_another_setting_changes(real_place, qtbot):
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
def test_the_folder_of_proofs_is_set_and_reset_here(real_place, qtbot, tmp_path, monkeypatch, name, good, bad):
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
    assert {name: editor.value for name, editor in form.editors.items()} == {
        "mean": 23.5, "spread": 1.25, "how": "data sheet"
    }  # fmt: skip
    form.show_offset(offset.model_copy(update={"measured": ""}), screen)
    assert form.said.text() == "23.5 ± 1.25 ms (data sheet)."
    form.editors["mean"].control.setText("17.25")
    form.keep.click()
    form.editors["spread"].control.setText("")
    form.keep.click()
    for refused in ("twelve", "", "501"):
        form.editors["mean"].control.setText(refused)
        form.keep.setFocus()
        form.keep.click()
        assert form.editors["mean"].below.text() == "A number from 0 to 500 ms."
        assert form.editors["mean"].control.hasFocus()
    assert kept == [(17.25, 1.25, "data sheet"), (17.25, 0.0, "data sheet")]
    with qtbot.waitSignal(form.forgotten):
        form.forget.click()
