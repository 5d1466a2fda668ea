"""Windows in states that no click leads to, with the actions that show each state for the transcripts."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from PySide6.QtCore import Qt, QTimer, QUrl
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from study_app.app.session.preflight_controller import ComputerCheck
from study_app.devices.descriptor import Backend
from study_app.devices.doctor import Report
from study_app.devices.falcon.failures import failures_on
from study_app.gui.devices.diagnosis_dialog import DiagnosisDialog
from study_app.gui.home.dialogs import NewSessionDialog
from study_app.gui.home.study_facts import Interrupted
from study_app.gui.kit.devices import devices_shown
from study_app.gui.preflight.window import computer_checks
from study_app.gui.startup_window import OpeningWindow
from study_app.gui.theme.theme import DARK, LIGHT
from study_app.gui.theme.themed import apply_theme
from study_app.haptics.runtime.grants import Grant
from study_app.protocol.load import load
from study_app.store.workstation import DEFAULTS, DisplayOffset, MachineSettings
from study_app.workers.server import Refused
from tests.gui import windows
from tests.gui.home.home_window import open_home
from tests.gui.lab.states import LAB
from tests.gui.operator.states import DISK, RUNNING, STRIP, operator, strip
from tests.gui.results.sample import STUDY
from tests.gui.results.states import NOW, PAGE, PEOPLE, RESULTS, WRITING, page, writing
from tests.gui.transcript import Actions, clicked, in_turn, part_of, typed
from tests.gui.windows import FOUND, WELL, checked, preflight, results, show_settings, show_window


class Examined:
    """An examination whose answers a test sets."""

    def __init__(self, name: str, options: Any) -> None:
        self.name, self.options = name, options
        self.pending_answers: list[Any] = []
        self.closed = False

    @property
    def ended(self) -> bool:
        return self.closed

    def answers(self) -> list[tuple[int, Any]]:
        messages, self.pending_answers = self.pending_answers, []
        return [(1, message) for message in messages]

    def close(self) -> None:
        self.closed = True


FALCON = failures_on("linux")
REFUSED = Report(
    ("opened",),
    FALCON.findings({"permission"}, FALCON.before("permission")),
    ("this account does not have permission to open it"),
)
FALCON_WELL = Report(("opened", "homed"), FALCON.findings(passed=FALCON.before("unplugged")), None)


def diagnosis(qtbot: Any) -> DiagnosisDialog:
    begun: list[Examined] = []

    def begin(name: str, options: Any) -> Any:
        begun.append(Examined(name, options))
        return begun[-1]

    window: Any = DiagnosisDialog(None, LIGHT, "falcon", note="The force is off.", begin=begin)
    window.begun = begun
    window.findChild(QTimer).setInterval(10**6)
    return show_window(qtbot, window, (760, 600))  # type: ignore[no-any-return]


def report_messages(*messages: Any) -> Callable[[Any], None]:
    def act(window: Any) -> None:
        window.begun[-1].pending_answers = list(messages)
        window.findChild(QTimer).timeout.emit()

    return act


DIAGNOSIS: Actions = {
    "a step": report_messages("Pull the grip out.", "Push it in."),
    "found": report_messages(REFUSED),
    "copied": lambda window: window.copy.click(),
    "asks where": lambda window: window.support.click(),
    "not saved": lambda window: window.save_support(Path("missing") / "help.zip"),
    "saved": lambda window: window.save_support(Path("help.zip")),
    "again": lambda window: window.again.click(),
    "well": report_messages(FALCON_WELL),
    "refused": lambda window: (window.again.click(), report_messages(Refused("'mouse' is none"))(window)),
    "closed": lambda window: window.close_button.click(),
}


def of_devices(*backends: Backend, preferred: str = "falcon") -> Callable[[Any], None]:
    def act(place: Any) -> None:
        place.show_settings(MachineSettings(device=preferred))
        place.show_devices(devices_shown([*FOUND, *backends]))

    return act


DEVICES: Actions = {
    "connected": of_devices(Backend("falcon", "other", state="connected: FT1", can="felt, up to 8 N")),
    "to be checked": of_devices(
        Backend("falcon", "other", state="connected: FT1", can="felt, up to 8 N", why="home it")
    ),
    "another preferred": of_devices(preferred="falcon-emulated"),
    "looking": lambda place: place.show_looking(True),
    "firmware": lambda place: (
        place.show_looking(False),
        place.show_settings(MachineSettings.model_validate({"device": "falcon-emulated", "firmware": "/there/f.bin"})),
    ),
    "pressed": in_turn(
        clicked("rows.falcon.title", "rows.falcon.diagnose", "refresh"),
        typed("options.firmware.editor.control", " "),
        lambda place: (place.enter(), place.leave(), place.resize(928, 640)),
    ),
    "light": lambda place: apply_theme(place, LIGHT),
}


def of_settings(undo: str = "", **settings: Any) -> Callable[[Any], None]:
    return lambda place: show_settings(place, MachineSettings(**settings), undo=undo)


def chosen_at(choice: Any, at: int) -> None:
    choice.setCurrentIndex(at)
    choice.activated.emit(at)


SETTINGS: Actions = {
    "plain": lambda place: show_settings(place, DEFAULTS),
    "screen gone": of_settings("screen", screen="HDMI-7", screen_number=2, viewing_distance_mm=900.0),
    "first screen": of_settings(screen="eDP-1", screen_number=1, theme="dark", sound=True, device="falcon"),
    "outlets": of_settings(lsl_markers=True, lsl_samples="always", triggers="serial:COM3", camera="tcp://127.0.0.1:5"),
    "offset": of_settings(display_offset=DisplayOffset(mean_ms=23.5, spread_ms=1.25, screen="DP-1"), photodiode=True),
    "offset of another": of_settings(display_offset=DisplayOffset(mean_ms=23.5, screen="HDMI-1")),
    "offset refused": in_turn(typed("offset.editors.mean.control", "900"), clicked("offset.keep")),
    "offset kept": in_turn(typed("offset.editors.mean.control", "20"), clicked("offset.keep", "offset.forget")),
    "distance refused": typed("editors.viewing_distance_mm.control", "6"),
    "distance taken": typed("editors.viewing_distance_mm.control", "600"),
    "port refused": typed("editors.triggers.control", "COM3"),
    "port taken": typed("editors.triggers.control", "serial:COM3"),
    "switched": in_turn(
        clicked(
            "editors.sound.control",
            "editors.photodiode.control",
            "editors.lsl_markers.control",
            "devices",
            "check",
            "screens.radios.0",
        ),
        *(
            lambda place, name=name: chosen_at(place.editors[name].control, 1)
            for name in ("lsl_samples", "theme", "device")
        ),
        typed("editors.camera.control", " tcp://127.0.0.1:5000 "),
        typed("editors.triggers.control", " "),
    ),
    "stacked, light": lambda place: (place.resize(928, 640), apply_theme(place, LIGHT)),
}


def patch_page(qtbot: Any) -> QWidget:
    clock = SimpleNamespace(now=0)
    window: Any = windows.display_test(qtbot, now_ns=lambda: clock.now)
    window.clock = clock
    return window  # type: ignore[no-any-return]


def frames(window: Any) -> None:
    """Paint twenty frames, one of them late."""
    for number in range(20):
        window.clock.now += 16_666_667 * (1 + (number == 9))
        window.draw_frame()
        window.repaint()
    window.show_figures()


DISPLAY_TEST: Actions = {
    "measured": frames,
    "interval refused": typed("interval.control", "9"),
    "interval taken": typed("interval.control", "200"),
    "toggled": lambda window: (setattr(window.clock, "now", 10**9), window.draw_frame()),
    "small": lambda window: window.resize(1024, 640),
}


def computer(qtbot: Any) -> QWidget:
    below = QWidget()
    qtbot.addWidget(below)
    check = ComputerCheck(below, LIGHT, Path(), QApplication.screens()[0])
    window: Any = check.window
    window.below, window.check = below, check
    window.asked.disconnect()  # it would measure
    window.finished.disconnect()
    return show_window(qtbot, window, (860, 620))  # type: ignore[no-any-return]


def of_computer(backends: list[Backend], cache: Path | None, compiled: int, **facts: Any) -> Callable[[Any], None]:
    checks = computer_checks(replace(WELL, **facts), load("demo"), backends, cache=cache, compiled=compiled)
    return lambda window: window.show_checks(checks)


COMPUTER: Actions = {
    "measuring": lambda window: window.show_measuring(),
    "compiling": lambda window: window.show_compiled(0.4),
    "well": of_computer([Backend("falcon", "libusb", state="connected: 1", can="force")], Path("cache"), 0),
    "not well": of_computer(FOUND, None, 194, screen=replace(WELL.screen, refresh_hz=30.0), free_bytes=10**6),
    "asked again": lambda window: window.back.click(),
    "error": lambda window: window.show_sentence("The servo cannot start."),
    "compiled": of_computer(FOUND, Path("cache"), 194, grant=Grant("normal", "refused", locked=False, advice=("do",))),
}

# Before a session, home

FULL_DISK = replace(WELL, free_bytes=1)
PREFLIGHT: Actions = {
    "well": lambda window: window.show_view(checked(WELL)),
    "slow disk": lambda window: window.show_view(checked(replace(windows.SCALED, probe_s=0.4), error_n=0.031)),
    "fails": lambda window: window.show_view(checked(replace(FULL_DISK, fresh_share=0.5, probe_fault="it is full"))),
    "busy": lambda window: window.show_view(checked(WELL, busy=True)),
    "no error asked": lambda window: window.show_view(checked(WELL, asked_error=False)),
    "small": lambda window: window.resize(windows.LEAST_PREFLIGHT),
    "dark": lambda window: apply_theme(window, DARK),
}


def opening(qtbot: Any) -> OpeningWindow:
    clock = SimpleNamespace(now=0.0)
    window: Any = OpeningWindow("Preparing demo", "Participant P001", now_s=lambda: clock.now)
    window.clock = clock
    return show_window(qtbot, window, (560, 260))  # type: ignore[no-any-return]


OPENING: Actions = {
    "long": lambda window: (setattr(window.clock, "now", 72.0), window.findChild(QTimer).timeout.emit()),
    "compiled": lambda window: window.show_compiled(0.4),
    "the device asks": lambda window: (window.show_line("Pull the grip out."), window.findChild(QTimer).timeout.emit()),
    "ready": lambda window: window.finish(),
}


def of_home(act: Callable[[Any], object]) -> Callable[[Any], object]:
    return lambda window: act(window.place("home"))


STOPPED = Interrupted(
    folder=STUDY / "P007",
    source="demo",
    participant="P007",
    heading="P007 was interrupted in trial 3",
    line="31 of 62 answers are on disk",
)
HOME: Actions = {
    "sessions": of_home(lambda home: home.sessions.show_sessions(PEOPLE, "results", NOW)),
    "all kinds": of_home(lambda home: home.sessions.kind.setCurrentIndex(4)),
    "a row": of_home(lambda home: home.sessions.rows.table.selectRow(2)),
    "pilots": of_home(lambda home: home.sessions.kind.setCurrentIndex(1)),
    "interrupted": of_home(lambda home: home.banner.show_interrupted(STOPPED)),
    "device": of_home(lambda home: home.show_machine(MachineSettings(device="falcon"), devices_shown(FOUND)[1])),
    "small": lambda window: window.resize(1024, 640),
    "says something": lambda window: window.show_message("The studies could not be read", "The folder is gone."),
    "dark": lambda window: window.rail.switch.click(),
}


def text(path: str, words: str) -> Callable[[Any], None]:
    return lambda window: part_of(window, path).setText(words)


def chosen(path: str, value: str) -> Callable[[Any], None]:
    return lambda window: part_of(window, path).setCurrentIndex(part_of(window, path).findData(value))


def new_session(qtbot: Any) -> Any:
    return windows.dialog(NewSessionDialog, qtbot, Path())


def used(folder: str, name: str) -> Callable[[Any], None]:
    """Return an action: another program writes a file of a session, or of another study, meanwhile."""

    def act(_dialog: Any) -> None:
        Path(folder).mkdir(parents=True)
        Path(folder, name).write_text('{"name": "otherstudy"}', encoding="utf-8", newline="\n")

    return act


NEW_SESSION: Actions = {
    "no id": text("editors.participant.control", "P-7"),
    "an id of pilots": text("editors.participant.control", "test"),
    "pilot": clicked("editors.pilot.control"),
    "no pilot, no seed": in_turn(
        clicked("editors.pilot.control"), text("editors.participant.control", "P009"), text("editors.seed.control", "")
    ),
    "another seed, Dutch": in_turn(text("editors.seed.control", "4711"), chosen("editors.language.control", "nl")),
    "session 2": lambda dialog: dialog.editors["session"].show_value(2),
    "simulated hand": chosen("editors.device.control", "scripted"),
    "Falcon": in_turn(chosen("editors.device.control", "falcon"), clicked("editors.windowed.control")),
    "firmware gone": text("editors.firmware.control", "gone.bin"),
    "own folder": in_turn(text("editors.firmware.control", ""), text("editors.results.control", "mine")),
    "folder of another study": in_turn(
        used("other", "dataset_description.json"), text("editors.results.control", "other")
    ),
    "used by another program": in_turn(
        used("rek2024/data/sub-P007/ses-01", "checksums.sha256"),
        text("editors.results.control", "rek2024"),
        chosen("editors.device.control", "mouse"),
        lambda dialog: dialog.editors["session"].show_value(1),
        text("editors.participant.control", "P007"),
    ),
    "next session number": clicked("suggestions.0"),
    "another id": in_turn(lambda dialog: dialog.editors["session"].show_value(1), clicked("suggestions.1")),
    "begun by Enter": lambda dialog: QTest.keyClick(dialog.editors["participant"].control, Qt.Key.Key_Return),
}
HELP: Actions = {
    "search": lambda place: QTest.keyClicks(place.search_field, "photodiode"),
    "a result": lambda place: QTest.keyClick(place.search_field, Qt.Key.Key_Down),
    "nothing found": lambda place: QTest.keyClicks(place.search_field, " zebra"),
    "narrow": lambda place: (place.search_field.clear(), place.resize(928, 640)),
    "back": clicked("back"),
    "no such page": lambda place: place.reader.anchorClicked.emit(QUrl("no-such-page.md")),
    "dark": lambda place: apply_theme(place, DARK),
}

STATES: dict[str, tuple[Callable[[Any], Any], Actions]] = {
    "operator": (operator, RUNNING),
    "operator, single-blind": (
        lambda qtbot: operator(qtbot, force_limit_n=6.0, felt=False, stop_button="device button 4"),
        DISK,
    ),
    "strip": (strip, STRIP),
    "lab": (windows.lab, LAB),
    "results": (lambda qtbot: results(qtbot).main, RESULTS),
    "export": (writing, WRITING),
    "session": (page, PAGE),
    "diagnosis": (diagnosis, DIAGNOSIS),
    "devices": (windows.devices, DEVICES),
    "settings": (windows.set_machine, SETTINGS),
    "display test": (patch_page, DISPLAY_TEST),
    "computer": (computer, COMPUTER),
    "preflight": (preflight, PREFLIGHT),
    "opening": (opening, OPENING),
    "new session": (new_session, NEW_SESSION),
    "help": (windows.help_pages, HELP),
    "home": (lambda qtbot: open_home(qtbot, Path()).main, HOME),
}
