"""The views and actions of the controllers of the main window's pages at each signal and answer.

People change the files in ``places``; no option regenerates them.
"""

import sys
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

from PySide6.QtCore import QEvent, QObject, Signal
from PySide6.QtWidgets import QApplication, QDialog, QLabel

from study_app.analysis import worker_messages as of
from study_app.app.compilation import Compilation
from study_app.app.failures import BUG
from study_app.app.main_controller import MainController, WorkstationController
from study_app.devices.descriptor import NONE, READY, Backend
from study_app.errors import DeviceNotFound
from study_app.gui.devices.view import DevicesPlace
from study_app.gui.kit.devices import device_named
from study_app.gui.results.view import ResultsPlace
from study_app.gui.theme.theme import DARK
from study_app.session.start import NewSession
from study_app.store.exclusions import Exclusion
from study_app.store.workstation import load_settings
from study_app.workers.server import Crashed, Refused
from tests.golden import as_on_linux, check_kept, what_comes
from tests.golden_values import changed, value_lines
from tests.session.small import CHOSEN

KEPT = Path(__file__).parent / "places"
STUDY, OTHER = Path("results", "one"), Path("results", "two")
AT = "2026-11-20T10:00:00+00:00"
ROW = {
    "participant": "P001", "session": 1, "study": "one", "status": "complete", "validity": "valid", "responses": 8,
    "simulated": False, "pilot": False, "session_started_at": AT, "resumed": False, "lost": 1, "reconnected": 2,
}  # fmt: skip


class Worker:
    """A worker that records its orders and returns given answers."""

    def __init__(self, events: list[str]) -> None:
        self.done, self.pending_answers, self.number, self.works = events, list[Any](), 0, True
        events.append("worker starts")

    def order(self, order: Any) -> int:
        self.number += 1
        self.done.append(f"{self.number} {order}")
        return self.number

    def answers(self) -> list[Any]:
        answers, self.pending_answers = self.pending_answers, []
        return answers

    def stop(self) -> None:
        self.done.append("worker is stopped")

    def close(self) -> None:
        self.done.append("worker is closed")


def figure(name: str, title: str = "Agreement") -> Any:
    return of.FigureDrawn(name=name, title=title, caption="n = 1", svg=b"")


FOUND = of.StudiesFound((of.StudyAt(STUDY, True, False, 5.0), of.StudyAt(OTHER, False, True, 3.0)))
WHOLE = of.StudyFound("one", "One", 1, 2, False, {("P001", 1): ((1, "L1"),)}, ("a file",), {"L1": "#000000"})
OUT = Exclusion(
    participant="P001",
    session=1,
    trial=2,
    rule_or_person="AK",
    reason="asleep",
    excluded_at="2026-11-20T11:00:00+00:00",
)
SESSIONS = of.SessionsFound(
    STUDY, (ROW, ROW | {"participant": "P002", "status": "unfinished", "responses": 3}), (OUT,), None
)
RESULTS: list[tuple[str, Any]] = [
    ("entered", ()), ("answer", of.Progress("looking", 0.5)), ("answer", FOUND), ("late", of.Done()),
    ("answer", SESSIONS), ("answer", figure("a")), ("answer", WHOLE), ("late", figure("z")),
    ("slow", of.Progress("drawing", 0.25)), ("answer", figure("b")), ("slow", of.Progress("testing", 0.75)),
    ("answer", figure("a", "Again")), ("answer", of.Done()), ("study_asked", (STUDY,)), ("study_asked", (OTHER,)),
    ("answer", replace(SESSIONS, folder=OTHER, exclusions=(), reveal={"by": "AK", "reason": "closed",
     "at": "2026-11-21T10:00:00+00:00"})), ("answer", replace(WHOLE, blocks=0, doubts=())), ("answer", of.Done()),
    ("leave_out_asked", (("P001", 1, None, "AK", "asleep"),)), ("answer", Refused("it is excluded", stopped=False)),
    ("take_back_asked", (("P001", 1, 2, "AK", "awake"),)), ("answer", of.Done()), ("unblind_asked", ("AK", "closed")),
    ("answer", of.Done(warnings=("a table", "another"))), ("remedy_asked", ("stop",)),
    ("answer", Refused("stopped", stopped=True)), ("remedy_asked", ("read",)), ("answer", WHOLE),
    ("answer", figure("a")), ("answer", figure("b")), ("answer", Refused("stopped", stopped=True)),
    ("remedy_asked", ("again",)), ("answer", Refused("no folder", stopped=False)), ("remedy_asked", ("again",)),
    ("answer", FOUND), ("answer", Refused("cut", stopped=False)), ("remedy_asked", ("again",)), ("answer", FOUND),
    ("answer", replace(SESSIONS, rows=())), ("answer", Refused("none", stopped=False)), ("answer", Crashed(-9)),
    ("remedy_asked", ("again",)), ("answer", Crashed(1)), ("dead", None), ("remedy_asked", ("again",)),
    ("answer", FOUND), ("tables_asked", (Path("to"), ("wide",))), ("written", of.Progress("writing", 0.5)),
    ("stop_asked", ()), ("written", of.Done((Path("to", "a.csv"),))), ("report_asked", (Path("to"), ())),
    ("written", Crashed(2)), ("report_asked", (Path("to"), ())), ("written", Refused("full", stopped=False)),
    ("open_asked", (Path("to"),)), ("none", of.StudiesFound(())), ("choose", (OTHER,)), ("left", ()), ("entered", ()),
    ("answer", FOUND), ("others", (Path("elsewhere"),)), ("left", ()),
]  # fmt: skip


def exclusion(values: tuple[Any, ...]) -> dict[str, Any]:
    return dict(zip(("participant", "session", "trial", "by", "reason"), values, strict=True))


def test_results(qtbot: Any) -> None:
    events: list[str] = []
    workers: list[Worker] = []

    def start() -> Any:
        workers.append(Worker(events))
        return workers[-1]

    place = ResultsPlace(Path("results"), opener=lambda file: events.append(f"open {file}"), start_worker=start)
    place._listening.setInterval(10**8)
    qtbot.addWidget(place)
    asks: dict[str, Any] = {
        "entered": place.enter, "left": place.leave, "study_asked": place._choose_study,
        "remedy_asked": place._apply_remedy,
        "leave_out_asked": lambda values: place._order_decision("excluding data", of.LeaveOut, **exclusion(values)),
        "take_back_asked": lambda values: place._order_decision(
            "reversing the exclusion", of.TakeBack, **exclusion(values)
        ),
        "unblind_asked": lambda by, reason: place._order_decision(
            "unblinding the study", of.OpenKey, by=by, reason=reason
        ),
        "tables_asked": lambda *values: place._start_writing(of.WriteTables, *values),
        "report_asked": lambda to, _extras: place._start_writing(of.WriteReport, to), "stop_asked": place._stop_writing,
        "open_asked": place._opener, "choose": place.choose_study, "others": place.show_results,
    }  # fmt: skip
    place.message.connect(lambda *words: events.append(f"message {words}"))
    lines, before = [], list[str]()
    for name, values in RESULTS:
        events.clear()
        reader: Any = place.reader
        match name:
            case "answer" | "slow" | "late" | "none":
                if name == "none":
                    place.read_studies()
                reader.pending_answers = [(reader.number - (name == "late"), values)]
                place._sent_s -= 10.0 * (name == "slow")
                place._read_answers()
            case "written":
                workers[-1].pending_answers = [(1, values)]
                place._read_answers()
            case "dead":
                reader.works = False
            case _:
                asks[name](*values)
        after = [f"busy: {place.is_busy} {place._listening.isActive()}", *value_lines(place.view, "view")]
        heading = f"== {name} {values}"
        lines += [(as_on_linux(heading) if sys.platform == "win32" else heading)[:80], *events, *changed(before, after)]
        before = after
    check_kept(KEPT / "results.txt", what_comes(lines))


CHANGES: list[tuple[str, Any]] = [
    ("change", {"screen": "HDMI-2"}), ("change", {"screen": "HDMI-2"}), ("change", {"viewing_distance_mm": 600.0}),
    ("change", {"screen_width_mm": 500.0}), ("operator", "AK"), ("operator", ""), ("operator", "AK"),
    ("protocol", Path("/studies/a.toml")), ("protocol", Path("/studies/a.toml")), ("protocol", Path("/studies/b.toml")),
    ("change", {"device": "falcon"}), ("change", {"firmware": "/there/firmware.bin"}), ("change", {"theme": "dark"}),
    ("change", {"sound": True}), ("change", {"photodiode": True}), ("measured", (23.5, 1.2, "photodiode", "DP-1")),
    ("change", {"triggers": "serial:COM3"}), ("change", {"camera": "tcp://127.0.0.1:5000"}),
    ("change", {"lsl_markers": True}), ("change", {"lsl_samples": "always"}),
    ("change", {"workspace": "/elsewhere"}), *[("undo", None)] * 15,
]  # fmt: skip


def test_settings(qtbot: Any, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path / "workspace"))
    machine = WorkstationController()
    qtbot.addWidget(machine.make_place())
    heard: list[str] = []
    machine.changed.connect(lambda settings: heard.append(f"changed, kept: {settings == load_settings()}"))
    machine.troubled.connect(lambda *words: heard.append(f"troubled {words[0]}"))
    lines, before = [], list(value_lines(machine.settings, "settings"))
    changes = list[Any]()
    actions: dict[str, Any] = {
        "measured": lambda values: machine.store_display_offset(*values),
        "operator": machine.remember_operator,
        "protocol": machine.remember_protocol,
        "change": machine.change_settings,
        "undo": lambda _: machine.undo(),
    }
    for name, value in CHANGES:
        heard.clear()
        was = machine.settings
        actions[name](value)
        now = machine.settings
        if name == "undo" and changes:
            assert now == changes.pop().model_copy(update={"operator": was.operator, "recent": was.recent})
        elif now != was and name in {"change", "measured"}:
            changes.append(was)
        settings = (line.replace(date.today().isoformat(), "TODAY") for line in value_lines(now, "settings"))
        after = [*settings, f"undo: {machine.undo_name}"]
        lines += [f"== {name} {value}", *heard, *changed(before, after)]
        before = after
    assert not changes
    check_kept(KEPT / "settings.txt", what_comes(lines))


MOUSE, FALCON = (
    Backend("mouse", "the program", state=READY, can="moves the ball"),
    Backend("falcon", "libusb", state=NONE, can="no"),
)


def test_devices(qtbot: Any, tmp_path: Path, monkeypatch: Any) -> None:
    machine = WorkstationController()
    heard: list[str] = []
    outcomes: list[Any] = [[MOUSE, FALCON], DeviceNotFound("no bus"), [MOUSE]]

    def look() -> Any:
        outcome = outcomes.pop(0)
        if isinstance(outcome, Exception):
            raise outcome
        return outcome

    class Dialog:
        def __init__(self, _parent: Any, _theme: Any, name: str, *, options: Any, note: str) -> None:
            heard.append(f"diagnosis of {name} {dict(options)} {note}")

        def __getattr__(self, name: str) -> Any:
            return self if name in ("finished", "over", "deleteLater") else lambda *_: heard.append(f"dialog {name}")

        def connect(self, _slot: Any) -> None: ...

    monkeypatch.setattr("study_app.gui.devices.diagnosis_dialog.DiagnosisDialog", Dialog)
    place = DevicesPlace(machine.settings, look)
    qtbot.addWidget(place)
    machine.changed.connect(place.show_settings)
    place.changed.connect(machine.change_settings)
    place.looked.connect(lambda: heard.append(f"looked {len(place.shown)}"))
    place.troubled.connect(lambda *words: heard.append(f"troubled {words}"))
    lines, before = list[str](), list[str]()
    steps: list[tuple[str, Any]] = [
        ("enter", None), ("change", {"device": "falcon"}), ("look", None), ("change", {"firmware": "/f.bin"}),
        ("change", {"device": "falcon:FT1"}), ("diagnose", "falcon"), ("diagnose", "mouse"), ("leave", None),
        ("look", None), ("end", None), ("look", None),
    ]  # fmt: skip
    for name, value in steps:
        heard.clear()
        if name == "change":
            place.changed.emit(value)
        else:
            getattr(place, DEVICE_ACTS.get(name, name))(*([] if value is None else [value]))
        if place.looking.busy:
            heard.append(f"looking {place.refresh.isEnabled()}")
            place.looking.wait()
            QApplication.processEvents()
        after = [
            f"refresh: {place.refresh.isEnabled()}",
            *value_lines(device_named(machine.settings.device, place.shown), "preferred"),
            *value_lines([device.word for device in place.shown], "shown"),
        ]
        lines += [f"== {name} {value}", *heard, *changed(before, after)]
        before = after
    check_kept(KEPT / "devices.txt", what_comes(lines))


DEVICE_ACTS = {"look": "look_for_devices", "end": "stop_looking"}


class Live(QObject):
    """A session that records its calls and ends on request."""

    over = Signal()
    done: list[str] = []  # noqa: RUF012 - shared on purpose
    error: Exception | None = None
    has_begun, is_opening, code = False, True, 0

    def __init__(self, chosen: NewSession, theme: Any, *, asks: bool, compilation: Compilation) -> None:
        super().__init__()
        self.theme, self.chosen = theme, chosen
        self.done.append(f"session of {chosen.participant} {theme.name} {asks}")

    def open(self) -> None:
        self.done.append("opens")

    def end_by_signal(self, number: int) -> None:
        self.done.append(f"ended by {number}")

    def wait(self, _patience_s: float) -> None:
        self.done.append("waited for")


def ends(**values: Any) -> Any:
    def end(visit: MainController) -> None:
        live: Any = visit.live
        vars(live).update(values)
        live.over.emit()

    return end


def home(name: str, *values: Any) -> Any:
    return lambda visit: getattr(visit.window.place("home"), name).emit(*values)


def go(name: str) -> Any:
    return lambda visit: visit.window.go(name)


STAY: dict[str, Any] = {
    "home": go("home"), "begin": home("session_asked", CHOSEN), "begin twice": home("session_asked", CHOSEN),
    "bug meanwhile": lambda visit: visit.show_bug(ValueError("x")), "called off": ends(),
    "begin again": home("session_asked", CHOSEN),
    "not found": ends(error=DeviceNotFound("no Falcon"), is_opening=False),
    "begin a third": home("session_asked", CHOSEN),
    "lost": ends(error=DeviceNotFound("gone"), has_begun=True, theme=DARK),
    "begin a fourth": home("session_asked", CHOSEN), "bug of it": ends(code=BUG, theme=DARK),
    "bug": lambda visit: visit.show_bug(ValueError("x")), "same bug": lambda visit: visit.show_bug(ValueError("x")),
    "protocol": home("protocol_opened", Path("/studies/mine.toml")), "results": home("results_asked", STUDY),
    "machine": go("machine"), "help": lambda visit: visit.show_help(), "help again": lambda visit: visit.show_help(),
    "devices": go("devices"), "workspace": lambda visit: visit.machine.change_settings({"workspace": "/elsewhere"}),
    "device": lambda visit: visit.machine.change_settings({"device": "scripted"}),
    "saved": lambda visit: visit._home_place.show_studies(),
    "trouble": lambda visit: visit.machine.troubled.emit("a", "b"), "begin last": home("session_asked", CHOSEN),
    "signal": lambda visit: visit.end_by_signal(15), "over": ends(), "end": lambda visit: visit.end(),
}  # fmt: skip


def test_the_stay(visit: MainController, monkeypatch: Any) -> None:
    monkeypatch.setattr("study_app.app.session.live_session.LiveSession", Live)
    monkeypatch.setattr(ResultsPlace, "read_studies", lambda self: Live.done.append(f"look at {self.view.chosen}"))
    monkeypatch.setattr(DevicesPlace, "look_for_devices", lambda _self: Live.done.append("look for devices"))
    lines, before = list[str](), list[str]()
    visit.window.closed.connect(lambda: Live.done.append("closed"))
    for name, step in STAY.items():
        Live.done.clear()
        step(visit)
        notices = [dialog for dialog in visit.window.findChildren(QDialog) if dialog.isVisible()]
        notice_texts = [f"{dialog.windowTitle()}: {dialog.findChildren(QLabel)[1].text()}" for dialog in notices]
        for dialog in notices:
            dialog.reject()
        QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
        page = visit.help.reader.page if visit.help is not None else ""
        after = [
            f"{visit.window.here}, {visit.window.theme.name}",
            f"visible: {visit.window.isVisible()}, session: {visit.live is not None}, code: {visit.code}",
            f"help: {page}, called off: {len(visit._called_off)}",
            f"operator: {visit.machine.settings.operator}, results: {visit.results.name}",
        ]
        lines += [f"== {name}", *Live.done, *notice_texts, *changed(before, after)]
        before = after
    check_kept(KEPT / "stay.txt", what_comes(lines))
