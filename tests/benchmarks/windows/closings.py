"""Close each window, and take the folder's permissions, in each phase of a session in real windows.

Run as ``python -m tests.benchmarks.windows.closings [windows] [permissions]``. The windows are offscreen, the Falcon is
emulated, and each case is a session of half a minute. Where the session waits after the fault, the force must be off.
After the session the emulated device must exert no force, `verify` must find no error, and once the session is resumed,
every answer must be there once. Prints how often each fault was caused, and what was wrong; the exit code is 1 if
anything was.

Permissions are taken in two ways: the modes of folders and files forbid writing (root first gives up the capability
to write nevertheless), or, as root, ``chattr +i`` makes them immutable, which also stops writing to open files.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeAlias
from unittest import mock

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QDialog, QWidget

from study_app.app import resume, run
from study_app.app.session import live_session
from study_app.devices.hand import hand_of
from study_app.devices.rig import Rig
from study_app.errors import StudyError
from study_app.gui.application import application_here
from study_app.gui.operator.window import OperatorWindow
from study_app.gui.participant.window import ParticipantWindow
from study_app.gui.preflight.window import PreflightWindow
from study_app.gui.startup_window import OpeningWindow
from study_app.session import start
from study_app.session.pages import EndPage, FeedbackPage, PausePage, QuestionnairePage, TaskPage, TextPage, TroublePage
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.verification.whole_study import verify_study
from tests.faults.support.watched_program import Person, window

STUDY: Final = Path(__file__).with_suffix(".toml")
ANSWERS: Final = 7
PHASES: Final = (
    *("consent", "instructions", "trial", "questionnaire", "break", "interval", "rest of intervals", "choice"),
    *("feedback", "form", "debrief", "end"),
)
PAUSE: Final = "pause"
DIALOGS: Final = {
    "end question": lambda operator: operator.ask_to_end(),
    "repeat question": lambda operator: operator.ask_to_repeat(),
    "message": lambda operator: operator.show_message("A message", "It says something."),
    "diagnosis": lambda operator: operator.ask("diagnose"),
}
AWAY_S: Final = 3.0  # how long the permissions are taken
SOON_S: Final = 0.3
LONGEST_MS: Final = 100_000
MOST_RESUMED: Final = 60
Tell: TypeAlias = Callable[[str, int, list[str]], None]
"""Prints of a kind of fault how often it was caused, and what was wrong afterwards."""
Act: TypeAlias = Callable[["Case", ParticipantWindow, OperatorWindow], None]


def phase_of(page: Any) -> str:
    """Return the phase that a page belongs to."""
    match page:
        case TextPage():
            return str(page.kind)
        case TaskPage(interval=None):
            return "trial"
        case TaskPage():
            return "rest of intervals" if page.interval.resting else "interval"
        case QuestionnairePage():
            return "questionnaire" if page.form is None else "form"
        case FeedbackPage():
            return "feedback"
        case EndPage():
            return "end"
        case PausePage():
            return PAUSE
        case TroublePage():
            return ""
        case _:
            return "choice"


RIGS: Final[list[Rig]] = []
"""The devices that were opened, the current one last."""


class Case:
    """One session with a fault in each of some phases, resumed until it is complete.

    ``done`` lists the phases in which the fault was caused, and ``faults`` what was wrong afterwards.
    """

    def __init__(self, folder: Path, phases: Iterable[str], act: Act) -> None:
        self.results = folder / "results"
        self.results.mkdir(parents=True)
        self._due, self._act = Counter(phases), act
        self.phase = "opening"
        self.done: list[str] = []
        self.faults: list[str] = []
        self.acted_s = 0.0
        self.waited: set[str] = set()  # the phases in which the session waited for its folder
        self.next: Callable[[ParticipantWindow, OperatorWindow], bool] | None = None  # a second step of the fault

    def check(self, holds: bool, fault: str) -> None:
        if not holds:
            self.faults.append(f"{self.phase}: {fault}")

    @property
    def force_is_on(self) -> bool:
        return bool(RIGS[-1].servo.force_is_on)

    def look(self, participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        """Cause the fault when its phase is reached; resume a session that waits."""
        if self.next is not None:
            return self.next(participant, operator)
        page = participant.page
        if self._due[phase := phase_of(page)]:
            if phase in ("trial", "interval") and not self._is_pushed():
                return True
            self._due[phase] -= 1
            self.done.append(phase)
            self.phase, self.acted_s = phase, time.perf_counter()
            self._act(self, participant, operator)
            return True
        if isinstance(page, PausePage):
            operator.ask("resume")
            return True
        if isinstance(page, TroublePage) and not operator.banner.reconnect.isVisible():
            self.check(not self.force_is_on, "force in trouble")
        return False

    def check_force_soon(self) -> None:
        """Check `SOON_S` later, before the session continues, that the device exerts no force."""

        def check(*_windows: object) -> bool:
            if time.perf_counter() > self.acted_s + SOON_S:
                self.check(not np.any(_exerted(RIGS[-1])), "the device exerts a force while the session waits")
                self.next = None
            return True

        self.next = check

    def _end_hung(self) -> None:
        participant_window = window(ParticipantWindow)
        self.faults.append(f"{self.phase}: hung at {participant_window and participant_window.page!r:.60}")
        os.kill(os.getpid(), signal.SIGTERM)

    def _is_pushed(self) -> bool:
        return bool(np.any(_exerted(RIGS[-1])))

    def run(self, hold: Callable[[], int]) -> str:
        """Run a session; return how it ended."""
        person = Person(self.look)
        late = QTimer(singleShot=True, interval=LONGEST_MS)
        late.timeout.connect(self._end_hung)
        late.start()
        try:
            return f"exit code {hold()}"
        except StudyError as error:
            return str(error)
        finally:
            late.stop()
            person.leave()
            if RIGS:
                self.check(not np.any(_exerted(RIGS[-1])), "a last force that is not zero")

    def hold(self) -> None:
        """Run the session, resume it while it is unfinished, and count its answers."""
        where = {"device": "falcon-emulated", "windowed": True}
        ended = self.run(lambda: run(str(STUDY), participant="P001", seed=3, results=self.results, **where))
        sessions = list(StudyFolder(self.results).sessions())
        if len(sessions) != 1:
            self.faults.append(f"the session is not on the disk: {ended}")
            return
        for _ in range(MOST_RESUMED):
            self.faults += verify_study(self.results).errors
            before = sessions[0].journal.read_bytes()
            if "session_ended" in [line.event for line in journal.read(sessions[0].journal)]:
                break
            ended = self.run(lambda: resume(sessions[0].path, protocol=str(STUDY), **where))
            self.check(sessions[0].journal.read_bytes().startswith(before), "lines of the journal changed")
        lines = journal.read(sessions[0].journal)
        answer_counts = Counter(
            (line.fields().get("trial"), line.fields().get("form"), item["item"])
            for line in lines
            if line.event in ("responses", "form_answered")
            for item in line.fields()["items"]
        )
        self.check(
            len(answer_counts) == answer_counts.total() == ANSWERS,
            f"{answer_counts.total()} answers, {len(answer_counts)} different",
        )
        self.check(lines[-1].fields().get("status") == "completed", f"the last line is {lines[-1].fields()}: {ended}")


def _exerted(rig: Rig) -> Any:
    """Return the torques that the emulated Falcon exerts."""
    return np.asarray(hand_of(rig.device).torques, float)  # type: ignore[union-attr]


# Windows that are closed.


def close_participant(case: Case, participant: ParticipantWindow, operator: OperatorWindow) -> None:
    participant.windowHandle().close()
    if case.phase == "end":
        operator.buttons.close_session.click()
        return
    case.check(participant.isVisible(), "the participant's window is gone")
    case.check(isinstance(participant.page, PausePage), f"{type(participant.page).__name__} instead of a pause")
    case.check_force_soon()


def close_operator(times: int, case: Case, _participant: ParticipantWindow, operator: OperatorWindow) -> None:
    operator.windowHandle().close()
    if case.phase == "end":
        return
    case.check(not case.force_is_on, "force after closing the operator's window")
    case.check(operator.question is not None, "the operator is not asked")
    case.check_force_soon()
    if times == 2:
        case.next = None
        operator.windowHandle().close()
    elif operator.question is not None:
        operator.question.windowHandle().close()


def close_dialog(name: str, case: Case, _participant: ParticipantWindow, operator: OperatorWindow) -> None:
    DIALOGS[name](operator)
    for dialog in operator.findChildren(QDialog):
        if dialog.isVisible():
            dialog.windowHandle().close()
    case.check(not [dialog for dialog in operator.findChildren(QDialog) if dialog.isVisible()], f"{name} stays open")


# Painters that fail.


# Permissions that are taken.


def take_permissions(kind: str, case: Case, _participant: ParticipantWindow, _operator: OperatorWindow) -> None:
    def wait(participant: ParticipantWindow, _operator: OperatorWindow) -> bool:
        if isinstance(participant.page, TroublePage):
            case.check(not case.force_is_on, "force while it waits for the disk")
            case.waited.add(case.phase)
        if time.perf_counter() > case.acted_s + AWAY_S:
            _set_permissions(case.results, kind, writable=True)
            case.next = None
            return True
        return phase_of(participant.page) != case.phase or case.phase == "end"

    case.next = wait
    _set_permissions(case.results, kind, writable=False)


def _set_permissions(folder: Path, kind: str, *, writable: bool) -> None:
    if kind == "modes":
        command = ["chmod", "-R", "u+w" if writable else "a-w", str(folder)]
    else:
        command = ["chattr", "-R", "-i" if writable else "+i", str(folder)]
    subprocess.run(command, check=writable)  # a temporary file may vanish while permissions are taken


def start_when_asked() -> None:
    """Press Start in the window of the pre-flight."""
    preflight_window = window(PreflightWindow)
    if preflight_window is not None and preflight_window.start.isEnabled():
        preflight_window.start.click()


def close_while_starting(kind: type[QWidget], folder: Path) -> list[str]:
    """Close a window that is shown before a session; return the faults afterwards."""
    closed: list[bool] = []

    def look() -> None:
        if (window_found := window(kind)) is not None and not closed:
            closed.append(window_found.windowHandle().close())

    with every_20_ms(look):
        code = run(str(STUDY), participant="P001", device="falcon-emulated", windowed=True, results=folder)
    faults = [] if closed and code == live_session.CANCELLED else [f"closed: {closed}, exit code {code}"]
    if RIGS and np.any(_exerted(RIGS[-1])):
        faults.append("a last force that is not zero")
    return faults + (["the session is on the disk"] if folder.exists() else [])


@contextmanager
def every_20_ms(look: Callable[[], None]) -> Iterator[None]:
    timer = QTimer(interval=20)
    timer.timeout.connect(look)
    timer.start()
    yield
    timer.stop()


def run_windows(folder: Path, tell: Tell) -> None:
    for kind in (OpeningWindow, PreflightWindow):
        tell(f"closed: {kind.__name__}", 1, close_while_starting(kind, folder / kind.__name__))
    acts: dict[str, Act] = {"participant": close_participant}
    acts |= {"operator": partial(close_operator, 1), "operator twice": partial(close_operator, 2)}
    acts |= {name: partial(close_dialog, name) for name in DIALOGS}
    with every_20_ms(start_when_asked):
        for name, act in acts.items():
            case = Case(folder / name, PHASES, act)
            case.hold()
            tell(f"closed: {name}", len(case.done), case.faults)


def run_permissions(folder: Path, tell: Tell) -> None:
    for kind in ("modes", "immutable") if os.geteuid() == 0 else ("modes",):
        for phases in (PHASES[::3], PHASES[1::3], PHASES[2::3]):  # a session goes on through the next ones meanwhile
            case = Case(folder / f"{kind}-{phases[0]}", phases, partial(take_permissions, kind))
            case.hold()
            where = f"{', '.join(case.done)} (waited in {len(case.waited)})"
            tell(f"permissions, {kind}: {where}", len(case.done), case.faults)


def heed_modes() -> None:
    """Start this program again without the capability of root to write where the modes forbid it."""
    if os.geteuid() == 0 and "LIQUID_STUDY_HEEDS_MODES" not in os.environ:
        os.environ["LIQUID_STUDY_HEEDS_MODES"] = "yes"
        command = ["setpriv", "--bounding-set", "-dac_override,-dac_read_search", sys.executable, "-m", __spec__.name]
        os.execvp(command[0], [*command, *sys.argv[1:]])  # noqa: S606 - this program


PARTS: Final = {"windows": run_windows, "permissions": run_permissions}


def run_part(run: Callable[[Path, Tell], None], *, asks: bool) -> bool:
    """Run a part in a folder of its own, and print a row for each kind of fault; return whether nothing was wrong."""
    failed: list[str] = []

    def tell(name: str, count: int, wrong: list[str]) -> None:
        failed.extend(wrong)
        print(f"| {name} | {count} | {len(wrong)} |", *wrong, sep="\n", flush=True)

    application_here()
    open_rig, live = live_session.open_rig, live_session.LiveSession
    with tempfile.TemporaryDirectory() as folder, ExitStack() as patched:
        for name in ("config", "data", "workspace"):
            os.environ[f"LIQUID_STUDY_{name.upper()}"] = str(Path(folder, name))
            Path(folder, name).mkdir()
        for module, name, replaced in (
            (start, "MEASURED_S", 0.2),
            (live_session, "open_rig", lambda *a, **k: RIGS.append(open_rig(*a, **k)) or RIGS[-1]),
            (live_session, "LiveSession", partial(live, asks=asks)),
        ):
            patched.enter_context(mock.patch.object(module, name, replaced))
        run(Path(folder), tell)
    return not failed


def main() -> int:
    """Run the parts, print their table, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", help=f"of {', '.join(PARTS)}; without one: all")
    parts = parser.parse_args().parts or list(PARTS)
    if "permissions" in parts:
        heed_modes()
    results = [run_part(PARTS[part], asks=part == "windows") for part in parts]
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
