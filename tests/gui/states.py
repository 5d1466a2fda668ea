"""Windows in states that no click leads to: each is a row of what is shown in turn, for the transcripts."""

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from PySide6.QtCore import QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QWidget

from study_app.app.computer_check import ComputerCheck
from study_app.devices.descriptor import Backend
from study_app.devices.doctor_report import Report
from study_app.devices.falcon.doctor.failure_report import findings_of
from study_app.devices.falcon.facts import OPEN
from study_app.devices.falcon.facts import Facts as FalconFacts
from study_app.errors import StoreError
from study_app.gui.devices.diagnosis_dialog import DiagnosisDialog
from study_app.gui.home.startup_window import OpeningWindow
from study_app.gui.operator import OperatorWindow
from study_app.gui.operator.strip import Strip
from study_app.gui.sessions.session_page import SessionPage
from study_app.gui.theme.theme import DARK, LIGHT
from study_app.gui.theme.themed import apply_theme
from study_app.haptics.model.layout import LIMITER_NORM, SAMPLE, records
from study_app.haptics.runtime.clocks.grants import Grant
from study_app.lab.ab_comparison import Setting, Workbench
from study_app.lab.presets import spoken
from study_app.lab.shadow import Trace
from study_app.protocol.load import load, load_scene
from study_app.store.exclusions import Exclusion
from study_app.store.workstation import DEFAULTS, DisplayOffset, MachineSettings
from study_app.viewmodels.computer_check import computer_checks
from study_app.viewmodels.devices.bench import BenchShown
from study_app.viewmodels.devices.list_view import devices_shown
from study_app.viewmodels.estimation import LSL, SOURCES, EstimateRow, EstimateShown
from study_app.viewmodels.force_traces import Forces
from study_app.viewmodels.home import Interrupted
from study_app.viewmodels.lab import Now
from study_app.viewmodels.results import FigureShown, Going, Opened, Trouble
from study_app.viewmodels.session.record import MOTION_HIDDEN, SessionRecord, TrialRecord
from study_app.workers.messages import Refused
from tests.gui import windows
from tests.gui.home.home_window import open_home
from tests.gui.lab.sample import blind, still_view, workbench
from tests.gui.operator.session import measured_health, new_session
from tests.gui.results.sample import LEFT_OUT, STUDY, SVG, facts, view
from tests.gui.windows import FOUND, WELL, checked, preflight, results, show_settings, shown

Actions = Mapping[str, Callable[[Any], object]]
NOW = datetime(2026, 11, 24, 12, tzinfo=UTC)
STARTED = NOW - timedelta(days=1)


class FixedTime(datetime):
    """A clock that stands still."""

    @classmethod
    def now(cls, tz: Any = None) -> datetime:  # type: ignore[override]
        return NOW if tz is None else NOW.astimezone(tz)


# Operator's window


def pushes(limiters: int) -> Any:
    """Return samples of a hand that is pushed to and fro by at most 2 N."""
    samples = records(SAMPLE, 4000)
    samples.tick = np.arange(4000)
    samples.time_ns = samples.tick * 1_000_000
    samples.scene = 1
    turn = samples.tick / 300
    samples.device_force_n = np.column_stack((2 * np.sin(turn), -np.cos(turn), 0.5 * np.sin(2 * turn)))
    samples.wake_mps = np.column_stack((0.2 * np.cos(turn), 0 * turn, 0.1 + 0 * turn))
    samples.limiters = np.where(samples.tick < 1500, limiters, 0)
    samples.permitted_n, samples.withheld_n = 2.0, 0.1
    return samples


def operator(qtbot: Any, **more: Any) -> OperatorWindow:
    made: Any = OperatorWindow("demo", lateness_limit_s=0.002, reach_m=0.05, pointer=True, **more)
    qtbot.addWidget(made, before_close_func=lambda window: setattr(window, "may_close", True))
    made.told, made.health, made.forces = new_session(), measured_health(), Forces(6.0)
    made.force_limited = "force_limit_n" in more
    if made.force_limited:
        made.told.make_single_blind()
        made.forces.take(pushes(LIMITER_NORM))
    shown(qtbot, made, (1366, 768))
    told()(made)
    return made  # type: ignore[no-any-return]


def told(*happened: Any, beyond: Mapping[str, Any] | None = None, **said: Any) -> Callable[[Any], None]:
    """Return an action: the session tells what happened, then the window shows it; ``beyond`` changes the view."""

    def act(window: Any) -> None:
        for one in happened:
            if callable(one):
                one(window.told)
            else:
                event, fields = one
                window.told.tell(event, 5.0, **fields)
        figures = {"forces": window.forces.figures()} if window.force_limited else {}
        window.show_view(replace(window.told.view(window.health, **figures, **said), **beyond or {}))
        window.show_traces(window.health, 4.0)
        window.show_lateness(window.health)
        window.show_forces(window.forces, 4_000_000_000)

    return act


def slowed(window: Any) -> None:
    """Let ticks come late and frames miss, a hand leave the tank and the device answer later."""
    samples = records(SAMPLE, 3000)
    samples.tick = np.arange(3000, 6000)
    samples.time_ns = samples.tick * 1_250_000
    samples.lateness_ns, samples.delay_ticks = 9_000_000, 4
    window.health.take(samples)
    window.health.overruns = 17
    window.health.frame(4_000_000_000)
    window.health.hand(100.0, (0.09, 0.0, 0.0))
    told(("note", {"kind": "mark", "text": ""}), dropped=1200, outlets_lost={"Serial port": "it was unplugged"})(window)
    window.show_traces(window.health, 100.0)


PAUSED = ("paused", {"by": "operator"})
RUNNING: Actions = {
    "trial 1": told(lambda it: it.welcome(), lambda it: it.start(1)),
    "two notes": told(*(("note", {"kind": "note", "text": text}) for text in ("Left-handed", "A long note " * 9))),
    "answering": told(lambda it: it.end(1, worst_gap_ms=31.0, lateness_p99_ms=9.5)),
    "trial 2": told(lambda it: it.answer(1), lambda it: it.start(2)),
    "paused": told(PAUSED),
    "resumed": told(("resumed", {"by": "operator"}), ("note", {"kind": "mark", "text": ""})),
    "force off": told(("force_stopped", {"by": "operator"}), PAUSED, force_on=False),
    "device lost": told(
        ("broke", {"what": "the device 'falcon' stopped responding"}),
        beyond={"may_reconnect": True, "reconnection": "Not connected: no arm found its index"},
        force_on=False,
        device_ready=False,
        faults=2,
    ),
    "reconnecting": told(beyond={"may_reconnect": True, "reconnects": True, "reconnection": "Opening"}, force_on=False),
    "in the dark theme": lambda window: window.header.theme_button.click(),
    "panel failed": lambda window: window.panels.draw(window.tiles, lambda: 1 / 0),
}
DISK: Actions = {
    "a form": told(lambda it: it.welcome()),
    "late": lambda window: (told(lambda it: it.start(3))(window), slowed(window)),
    "targets": told(*(("target_reached", {"trial": 3, "target": target, "t_task_s": 1.0}) for target in (0, 1))),
    "track": told(beyond={"track": ("Track V1: 9 of at most 24 answered", "longest run 8: check")}),
    "waiting for the disk": told(force_on=False, trouble="no space left on the disk: free some", waits=True),
    "recording lost": told(("recording_lost", {"trial": 3, "attempt": 1, "reason": "No space left on device"})),
    "asks to repeat": lambda window: window.ask_to_repeat(),
    "asks to exclude": lambda window: window.ask_to_exclude(),
    "asks to end": lambda window: window.ask_to_end(),
    "says something": lambda window: window.show_message("It cannot be", "The disk is full."),
    "small": lambda window: window.resize(window.minimumSize()),
    "large": lambda window: window.resize(1920, 1080),
    "complete": told(("session_ended", {"status": "completed", "reason": "", "fingerprint": "wwww-mmmm"})),
    "may be closed": lambda window: window.close(),
}


def strip(qtbot: Any) -> Strip:
    made: Any = shown(qtbot, Strip(), (900, 52))
    made.told = new_session()
    return made  # type: ignore[no-any-return]


def of_strip(**told: Any) -> Callable[[Any], None]:
    return lambda made: made.show_view(made.told.view(**told))


STRIP: Actions = {
    "preparing": of_strip(),
    "running": lambda made: (made.told.welcome(), made.told.start(1), of_strip()(made)),
    "force off": of_strip(force_on=False),
    "trouble": of_strip(trouble="The disk is full"),
    "narrow": lambda made: made.resize(420, 52),
}

# Liquid lab


def flowing() -> dict[str, Any]:
    """Return a motion of both sides, made up: a zigzag with three segments and two oscillating forces."""
    count = 300
    share = np.linspace(0.0, 1.0, count)
    places = np.column_stack((0.04 * np.sin(9 * share), 0.02 * np.cos(7 * share), 0.025 * share - 0.01))
    breaks = np.isin(np.arange(count), (0, 120, 230))
    tail = SimpleNamespace(positions_m=places, breaks=breaks, ages=1 - share, elements=1700, alive=1210, segments=3)
    t_s = np.linspace(-2.5, 0.0, 2500)
    wave = np.column_stack((np.sin(5 * t_s), np.cos(3 * t_s), 0.2 * t_s))
    speeds = (0.2 + 0.1 * np.sin(k * t_s) for k in (2, 3, 4))
    acting = still_view().limiters
    return {
        "trace": Trace(t_s, 3 * wave, 2 * wave[::-1], *speeds, felt_a=t_s < -1.0),
        "tail_a": tail,
        "tail_b": replace_fields(tail, positions_m=-places, segments=1, breaks=breaks & (share < 0.1)),
        "now": Now((0.01, 0.005, 0.004), (2.0, 1.0, 0.5), (0.3, -0.2, 0.1)),
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
    return Workbench(*(Setting(spoken(name), scenes[name], scenes[name]) for name in (a, b)))


def of_lab(**fields: Any) -> Callable[[Any], None]:
    return lambda place: place.show_view(still_view(**fields))


def shown_now(place: QWidget) -> None:
    """Let what waits for a single timer come at once."""
    for timer in place.findChildren(QTimer):
        if timer.isSingleShot() and timer.isActive():
            timer.start(0)


def refused(place: Any) -> None:
    """Type what is no number, and a length that the model refuses."""
    for name, text in (("wake.exponent", "0.5.5"), ("wake.length", "9000")):
        field = place.form.rows[name].field
        field.selectAll()
        QTest.keyClicks(field, text)
        QTest.keyClick(field, "\r")
    place.show_view(still_view(refused=("wake.length", "length 9000 exceeds scaling 2600: lower length")))


FOUND_VALUES = EstimateShown(
    source="other",
    sources=(*SOURCES, *LSL),
    rows=(EstimateRow("Drag coefficient", "0.4203", "0.419 … 0.422"), EstimateRow("Decay", "0.99", "0.98 … 1")),
    message="Residual 0.052 N, 12 % of the force; 10 s measured",
    sound=True,
    may_apply=True,
    may_follow=True,
)
LAB: Actions = {
    "moved": lambda place: place.show_view(still_view(**flowing())),
    "B felt": lambda place: place.show_view(still_view(workbench().switch(), **flowing())),
    "blind": lambda place: place.show_view(still_view(blind(workbench(), first="B"), **flowing())),
    "measuring": of_lab(cost=(), errors=(), tick_ns=None, measuring=True),
    "not measured": of_lab(cost=(), errors=()),
    "refused": refused,
    "flow curves, blind": lambda place: place.show_view(still_view(blind(slime("ketchup", "honey")))),
    "flow curves": lambda place: place.show_view(still_view(slime("ketchup", "honey"), estimate=FOUND_VALUES)),
    "other force limit": lambda place: place.show_view(
        still_view(slime("ketchup", "honey").change("scene.force_limit_n", 4.0), study="own")
    ),
    "estimate fails": of_lab(
        estimate=replace(FOUND_VALUES, sound=False, may_apply=False, follows=True, message="Too little motion.")
    ),
    "busy": lambda place: (of_lab(busy="Opening the Falcon")(place), shown_now(place)),
    "trouble": of_lab(trouble="No Falcon answers: check its cable."),
    "force off": of_lab(force_on=False, said="Saved as syrup.toml"),
    "path": of_lab(path="zigzag", study="own.toml"),
    "undone": lambda place: place.show_view(still_view(workbench().undo())),
    "narrow": lambda place: place.resize(928, 640),
    "dark": lambda place: apply_theme(place, DARK),
}

# Results, sessions, decisions


def of_results(**changes: Any) -> Callable[[Any], None]:
    return lambda window: window.place("results").show_view(view(**changes))


FIGURES = view().figures
PEOPLE = (
    facts("P001", status="damaged", validity=None),
    facts("P002", status="withdrawn", validity="invalid", answers=3, answers_of=62),
    facts("P003", excluded="fell asleep"),
    facts("P004", status="running", validity=None, session=2),
    facts("P005", status="aborted", reconnected=2, started=STARTED),
    facts("P006", simulated=False, pilot=True, outlets_lost=1, lost=3, started=NOW),
    facts("P007", simulated=False, status="broken", started=datetime(2025, 1, 2, 3, 4, tzinfo=UTC)),
)
RESULTS: Actions = {
    "all states": of_results(sessions=PEOPLE, left_out=(LEFT_OUT, replace(LEFT_OUT, what="P005", at=None))),
    "unblinded": of_results(sealed=False, opened=Opened(STARTED, "AK", "closed, " + "and so on " * 20)),
    "doubts": of_results(doubts=("P001/journal.jsonl", "P002/trials.csv"), chosen=Path("results/demo")),
    "pilot": of_results(studies=(replace(view().studies[0], kind="pilot"),)),
    "empty figure": of_results(figures=(replace(FIGURES[1], svg=b"", caption="No completed session."),)),
    "three figures": of_results(figures=(*FIGURES, FigureShown("third", "Third", "Caption.", SVG))),
    "drawing": of_results(figures=(), drawing=Going("drawing", 0.4)),
    "testing": of_results(testing=Going("testing: Unusable", 0.7)),
    "untested": of_results(untested=True),
    "trouble": of_results(figures=(), trouble=Trouble("It cannot be read", "P002 is damaged.", "Look", "again")),
    "reading": of_results(sessions=(), figures=()),
    "no sessions": of_results(sessions=(), figures=(), listed=True),
    "no study": of_results(studies=(), chosen=None, sessions=(), figures=()),
    "stacked": lambda window: (window.resize(1024, 640), of_results()(window)),
}


def writing(qtbot: Any) -> QWidget:
    """Return the dialog that exports tables, over results in which SPSS files cannot be written."""
    window = results(qtbot).main
    window.place("results").export.click()
    made: QWidget = window.place("results").writing
    made.over = window  # type: ignore[attr-defined]  # or it would be collected here
    return made


WRITING: Actions = {
    "begun": lambda dialog: (dialog.extras["wide"].click(), dialog.go_on.click()),
    "progress": lambda dialog: dialog.show_progress("making the tables", 0.3),
    "refused": lambda dialog: dialog.show_refused("/somewhere cannot be written"),
    "again": lambda dialog: dialog.go_on.click(),
    "stopping": lambda dialog: dialog.cancel.click(),
    "written": lambda dialog: dialog.show_written(
        [Path("/there/a.csv"), Path("/there/b.csv")], Path("/there"), [f"P00{n} is damaged" for n in range(5)]
    ),
    "opened": lambda dialog: dialog.go_on.click(),
}

TRIAL = TrialRecord(1, 1, "Part 1, L2", "complete", True, (), 9, (), "", Path("trial.parquet"), "", None)
BROKEN = replace(
    TRIAL,
    number=2,
    words="Part 1, L1",
    outcome="timeout",
    valid=False,
    broken=("longest time between two ticks: 41.3 ms, limit 20 ms", "lateness of ticks: 2.5 ms, limit 2 ms"),
    unconfirmed=("feels_liquid: 5",),
    notes="phone rang",
)
RECORD = SessionRecord(
    facts=facts("P007", simulated=False),
    about="Device mouse  ·  language en",
    limits="Out of limits: 1 of 2 measured trials exceeded a limit of the study.",
    trials=(
        TRIAL,
        BROKEN,
        replace(TRIAL, number=3, valid=None, outcome="running", answers=0, recording=None, lost="its thread ended"),
        replace(TRIAL, number=4, excluded="phone rang", attempt=2),
    ),
    notes=("09:31, trial 2: phone rang",),
    files=(("journal.jsonl", 1_234_567), ("receipt.json", 90), ("trials.csv", 5400)),
    left_out=(Exclusion("P007", 1, 4, "AK", "phone rang", STARTED.isoformat()),),
    motion_hidden="",
)
READ: dict[str, Any] = {}
"""What the page of a session reads: its record and its motion, or an error."""


def read(what: str) -> Any:
    """Return what is to be read, or raise it."""
    if isinstance(READ[what], Exception):
        raise READ[what]
    return READ[what]


def waves() -> tuple[Any, Any]:
    times_s = np.linspace(0.0, 30.0, 600)
    return times_s, np.column_stack([0.03 * np.sin(times_s * k + k) for k in (1.0, 1.7, 0.4)])


def page(qtbot: Any) -> SessionPage:
    below = QWidget()
    qtbot.addWidget(below)
    made: Any = SessionPage(below, LIGHT, RECORD.facts, lambda _path: None)
    made.below = below
    return shown(qtbot, made, (1040, 700))  # type: ignore[no-any-return]


def read_again(**changed: Any) -> Callable[[Any], None]:
    def act(made: Any) -> None:
        READ.update(changed)
        made.read()

    return act


PAGE: Actions = {
    **{f"trial {row + 1}": lambda made, row=row: made.trials.selectRow(row) for row in (1, 2, 3)},  # type: ignore[misc]
    "motion unread": lambda made: (READ.update(motion=StoreError("it is cut")), made.trials.selectRow(0)),
    "excluding": lambda made: made.leave_out.click(),
    "sealed": read_again(record=replace(RECORD, motion_hidden=MOTION_HIDDEN, left_out=(), notes=())),
    "session excluded": read_again(
        record=replace(
            RECORD,
            facts=facts("P007", status="withdrawn", validity="invalid", excluded="asleep"),
            left_out=(Exclusion("P007", 1, None, "AK", "asleep", STARTED.isoformat()),),
        )
    ),
    "empty": read_again(record=replace(RECORD, trials=(), files=())),
    "unreadable": read_again(record=StoreError("the journal cannot be read")),
    "dark": lambda made: apply_theme(made, DARK),
}

# Devices, this computer


class Examined:
    """An examination that says what it is given."""

    def __init__(self, name: str, options: Any) -> None:
        self.name, self.options = name, options
        self.told: list[Any] = []
        self.closed = False

    @property
    def ended(self) -> bool:
        return self.closed

    def answers(self) -> list[tuple[int, Any]]:
        told, self.told = self.told, []
        return [(1, one) for one in told]

    def close(self) -> None:
        self.closed = True


REFUSED = Report(("opened",), findings_of(FalconFacts(platform="linux", usb="access")), "this account may not open it")
FALCON_WELL = Report(("opened", "homed"), findings_of(FalconFacts(platform="linux", usb=OPEN)), None)


def diagnosis(qtbot: Any) -> DiagnosisDialog:
    begun: list[Examined] = []

    def begin(name: str, options: Any) -> Any:
        begun.append(Examined(name, options))
        return begun[-1]

    made: Any = DiagnosisDialog(None, LIGHT, "falcon", note="The force is off.", begin=begin)
    made.begun = begun
    made.findChild(QTimer).setInterval(10**6)
    return shown(qtbot, made, (760, 600))  # type: ignore[no-any-return]


def says(*told: Any) -> Callable[[Any], None]:
    def act(made: Any) -> None:
        made.begun[-1].told = list(told)
        made.findChild(QTimer).timeout.emit()

    return act


DIAGNOSIS: Actions = {
    "a step": says("Pull the grip out.", "Push it in."),
    "found": says(REFUSED),
    "copied": lambda made: made.copy.click(),
    "asks where": lambda made: made.support.click(),
    "not saved": lambda made: made.save_support(Path("missing") / "help.zip"),
    "saved": lambda made: made.save_support(Path("help.zip")),
    "again": lambda made: made.again.click(),
    "well": says(FALCON_WELL),
    "a row is opened": lambda made: made.rows[0].more.click(),
    "refused": lambda made: (made.again.click(), says(Refused("'mouse' is none"))(made)),
    "closed": lambda made: made.close_button.click(),
}


def of_devices(*found: Backend, preferred: str = "falcon") -> Callable[[Any], None]:
    return lambda place: place.show_devices(devices_shown([*FOUND, *found]), preferred)


DEVICES: Actions = {
    "connected": of_devices(Backend("falcon", "other", "connected: FT1", "felt, up to 8 N")),
    "to be checked": of_devices(Backend("falcon", "other", "connected: FT1", "felt, up to 8 N", "home it")),
    "another preferred": of_devices(preferred="falcon-socket:/run/falcon"),
    "looking": lambda place: place.show_looking(True),
    "firmware": lambda place: (place.show_looking(False), place.show_options({"firmware": Path("/there/f.bin")})),
    "benches": lambda place: place.show_benches(
        {"falcon": BenchShown("Measured: mass 0.20 kg.", Path("b.md")), "mouse": BenchShown("Missing: /gone.", None)}
    ),
    "stacked": lambda place: place.resize(928, 640),
    "no benches, light": lambda place: (place.show_benches({}), apply_theme(place, LIGHT)),
}


def typed(field: str, text: str) -> Callable[[Any], None]:
    """Return an action that types into a field, named by its attributes from the window, and presses Enter."""

    def act(made: Any) -> None:
        for name in field.split("."):
            made = getattr(made, name)
        made.setFocus()
        made.selectAll()
        QTest.keyClicks(made, text)
        QTest.keyClick(made, "\r")

    return act


def of_settings(undo: str = "", **settings: Any) -> Callable[[Any], None]:
    return lambda place: show_settings(place, MachineSettings(**settings), undo=undo)


SETTINGS: Actions = {
    "plain": lambda place: show_settings(place, DEFAULTS),
    "screen gone": of_settings("screen", screen="HDMI-7", screen_number=2, viewing_distance_mm=900.0),
    "first screen": of_settings(screen="eDP-1", screen_number=1, theme="dark", sound=True, device="falcon"),
    "outlets": of_settings(lsl_markers=True, lsl_samples="always", triggers="serial:COM3", camera="tcp://127.0.0.1:5"),
    "offset": of_settings(display_offset=DisplayOffset(mean_ms=23.5, spread_ms=1.25, screen="DP-1"), photodiode=False),
    "offset of another": of_settings(display_offset=DisplayOffset(mean_ms=23.5, screen="HDMI-1")),
    "offset refused": lambda place: (typed("offset.form.mean", "900")(place), place.offset.form.keep.click()),
    "offset kept": lambda place: (typed("offset.form.mean", "20")(place), place.offset.form.keep.click()),
    "distance refused": typed("seen.distance.field", "6"),
    "distance taken": typed("seen.distance.field", "600"),
    "port refused": typed("outlets.triggers", "COM3"),
    "port taken": typed("outlets.triggers", "serial:COM3"),
    "numbers": lambda place: place.screens.identify.click(),
    "stacked, light": lambda place: (place.resize(928, 640), apply_theme(place, LIGHT)),
}


def patch_page(qtbot: Any) -> QWidget:
    clock = SimpleNamespace(now=0)
    made: Any = windows.display_test(qtbot, now_ns=lambda: clock.now)
    made.clock = clock
    return made  # type: ignore[no-any-return]


def frames(made: Any) -> None:
    """Paint twenty frames, one of them late."""
    for number in range(20):
        made.clock.now += 16_666_667 * (1 + (number == 9))
        made.frame()
        made.repaint()
    made.show_figures()


DISPLAY_TEST: Actions = {
    "measured": frames,
    "interval refused": typed("interval", "9"),
    "interval taken": typed("interval", "200"),
    "toggled": lambda made: (setattr(made.clock, "now", 10**9), made.frame()),
    "offset refused": lambda made: (typed("offset.mean", "900")(made), made.offset.keep.click()),
    "offset": lambda made: made.show_offset(DisplayOffset(mean_ms=23.5, spread_ms=2.0, screen="Screen 1"), "Screen 1"),
    "forgotten": lambda made: made.offset.forget.click(),
    "small": lambda made: made.resize(1024, 640),
}


def computer(qtbot: Any) -> QWidget:
    below = QWidget()
    qtbot.addWidget(below)
    check = ComputerCheck(below, LIGHT, Path(), below.screen())
    made: Any = check.window
    made.below, made.check = below, check
    made.asked.disconnect()  # it would measure
    made.finished.disconnect()
    return shown(qtbot, made, (860, 620))  # type: ignore[no-any-return]


def of_computer(found: list[Backend], cache: Path | None, compiled: int, **facts: Any) -> Callable[[Any], None]:
    given = computer_checks(replace(WELL, **facts), load("demo"), found, cache=cache, compiled=compiled)
    return lambda window: window.show_checks(given)


COMPUTER: Actions = {
    "measuring": lambda window: window.show_measuring(),
    "compiling": lambda window: window.show_compiled(0.4),
    "well": of_computer([Backend("falcon", "libusb", "connected: 1", "force")], Path("cache"), 0),
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
    made: Any = OpeningWindow("Preparing demo", "Participant P001", now_s=lambda: clock.now)
    made.clock = clock
    return shown(qtbot, made, (560, 260))  # type: ignore[no-any-return]


OPENING: Actions = {
    "long": lambda made: (setattr(made.clock, "now", 72.0), made.findChild(QTimer).timeout.emit()),
    "compiled": lambda made: made.show_compiled(0.4),
    "the device asks": lambda made: (made.say("Pull the grip out."), made.findChild(QTimer).timeout.emit()),
    "ready": lambda made: made.finish(),
}


def of_home(act: Callable[[Any], object]) -> Callable[[Any], object]:
    return lambda window: act(window.place("home"))


STOPPED = Interrupted(STUDY / "P007", "demo", "P007", "P007 was interrupted in trial 3", "31 of 62 answers are on disk")
HOME: Actions = {
    "sessions": of_home(lambda home: home.sessions.show_sessions(PEOPLE, "results", NOW)),
    "all kinds": of_home(lambda home: home.sessions.kind.setCurrentIndex(4)),
    "a row": of_home(lambda home: home.sessions.rows.table.selectRow(2)),
    "pilots": of_home(lambda home: home.sessions.kind.setCurrentIndex(1)),
    "interrupted": of_home(lambda home: home.banner.show_interrupted(STOPPED)),
    "device": of_home(lambda home: home.show_machine(MachineSettings(device="falcon"), devices_shown(FOUND)[1])),
    "small": lambda window: window.resize(1024, 640),
    "says something": lambda window: window.show_message("The studies could not be read", "The folder is gone."),
    "dark": lambda window: window.rail.theme_asked.emit(),
}

STATES: dict[str, tuple[Callable[[Any], Any], Actions]] = {
    "operator": (operator, RUNNING),
    "operator, single-blind": (lambda qtbot: operator(qtbot, force_limit_n=6.0, felt=False), DISK),
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
    "home": (lambda qtbot: open_home(qtbot, Path()).main, HOME),
}
