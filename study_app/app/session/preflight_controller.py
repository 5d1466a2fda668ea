"""The checks before a session and the decision to begin, and the check of a computer without a session."""

import threading
from collections.abc import Callable, Iterable
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from random import Random
from typing import NamedTuple

from PySide6.QtCore import QObject, Qt, QTimer, Signal
from PySide6.QtGui import QScreen
from PySide6.QtWidgets import QWidget

from study_app.devices.registry import descriptor_of
from study_app.errors import StudyError
from study_app.evidence.appraisal import Costs, DeliveryQuestion, Errors, Question, start_appraisal_worker
from study_app.gui.display import place_window
from study_app.gui.preflight.window import (
    ComputerWindow,
    PreflightView,
    PreflightWindow,
    computer_checks,
    planned_rows,
    resumed_rows,
)
from study_app.gui.theme import Theme
from study_app.gui.widgets import Background
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.scene import Scene
from study_app.protocol.model import Protocol
from study_app.protocol.trials import Stroke
from study_app.session.preflight import Check, Measurements, PredictedDelivery, Screen, preflight_checks
from study_app.session.resume import begun_schedule
from study_app.session.start import NewSession, Ready, measure_rig
from study_app.store.blinded import read_key, session_protocol
from study_app.store.files import StudyFolder, locate_session
from study_app.store.journals import journal
from study_app.store.journals.journal_events import start_of

_POLL_MS = 100
PATIENCE_S = 10.0


class SceneQuestion(NamedTuple):
    """A scene to appraise: its liquid, and the fastest stroke in it."""

    liquid: str
    scene: Scene
    stroke: Stroke


class Appraisal:
    """The cost of a study's most expensive scene and the error of its least accurate one, measured by a process.

    ``velocity_errors`` are those of `Measurements`, or None if the device's dynamics are known. ``withheld`` is the
    share of each liquid's force that is withheld in the fastest stroke on a device with ``dynamics``, once all scenes
    are appraised. ``delivery`` is the predicted loss of trials of a simulated participant, which is requested ``last``.
    """

    def __init__(
        self, scenes: Iterable[SceneQuestion], dynamics: Dynamics, last: DeliveryQuestion | None = None
    ) -> None:
        self._waiting = list(scenes)
        self._last = last
        self.dynamics = dynamics
        self.delivery: PredictedDelivery | None = None
        self._order_number = 0
        self.appraiser = start_appraisal_worker()
        self.tick_s: float | None = None
        self.error_n: float | None = None
        self.withheld: dict[str, float] | None = None
        self.velocity_errors: tuple[float, float] | None = None
        self._errors_n: list[float | None] = []
        self._shares: dict[str, float] = {}
        self._request_next()

    @property
    def is_over(self) -> bool:
        return (not self._waiting and self._last is None) or not self.appraiser.works

    def read_answers(self) -> bool:
        """Read the available answers; return whether a result has changed."""
        has_news = False
        for number, answer in self.appraiser.answers():
            if number != self._order_number or self.is_over:
                continue
            if isinstance(answer, Costs):
                self.tick_s = max(self.tick_s or 0.0, answer.tick_ns * 1e-9)
                has_news = True
                continue
            if not self._waiting:
                self.delivery = answer if isinstance(answer, PredictedDelivery) else None
                self._last, has_news = None, True
                continue
            self._errors_n.append(answer.force_n if isinstance(answer, Errors) else None)
            if isinstance(answer, Errors) and answer.velocity is not None:
                self.velocity_errors = max(answer.velocity, self.velocity_errors or answer.velocity)
            liquid = self._waiting.pop(0).liquid
            if isinstance(answer, Errors) and answer.withheld is not None:
                self._shares[liquid] = max(answer.withheld, self._shares.get(liquid, 0.0))
            self._request_next()
            if not self._waiting:
                self.error_n, self.withheld, has_news = _largest_error_n(self._errors_n), self._shares, True
        return has_news

    def _request_next(self) -> None:
        if self._waiting:
            _, scene, stroke = self._waiting[0]
            self._order_number = self.appraiser.order(Question(scene, stroke, self.dynamics))
        elif self._last is not None:
            self._order_number = self.appraiser.order(self._last)

    def close(self) -> None:
        self.appraiser.close()


class Preflight(QObject):
    """Shows the pre-flight window, repeats measurements on request, and emits the operator's decision once.

    The caller owns the rig, whose servo runs at rest meanwhile. ``failed`` is emitted if the servo stops itself or the
    participant's screen is removed. ``screen`` returns that screen (see ``choose_screens``).
    """

    started = Signal(object)
    cancelled = Signal()
    failed = Signal(object)

    def __init__(
        self,
        chosen: NewSession,
        protocol: Protocol,
        ready: Ready,
        screen: Callable[[], QScreen],
        who: str,
        theme: Theme,
    ) -> None:
        super().__init__()
        self._chosen, self._protocol, self._ready, self._screen = chosen, protocol, ready, screen
        self._who = who
        self._resumption = _resumption_rows(chosen, protocol)
        self.measuring = Background(self)
        self.measuring.done.connect(self._apply_measurements)
        self.measuring.failed.connect(self.failed)
        self._ending = threading.Event()
        self.appraisal = _start_appraisal(protocol, ready.facts)
        self.window = PreflightWindow(
            protocol.limits.lateness_ms * 1e3, asks_masking=descriptor_of(chosen.device).kind == "felt", theme=theme
        )
        self.window.start_asked.connect(self._accept)
        self.window.again_asked.connect(self._measure_again)
        self.window.cancelled.connect(self.cancelled)
        self._appraised = False
        self._outlets_shown = ready.outlet_statuses
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._watch_servo_and_screen)
        self._timer.start(_POLL_MS)

    def open(self) -> None:
        self._show_checks()
        place_window(self.window, self.window.screen(), corner=False)
        self.window.show()

    def close(self) -> None:
        """Close window and process, and wait for a running measurement, which uses the servo."""
        self._timer.stop()
        self._ending.set()
        self.appraisal.close()
        self.measuring.wait(PATIENCE_S)
        self.window.finish()
        self.window.deleteLater()
        self.deleteLater()

    @property
    def _facts(self) -> Measurements:
        appraisal, screen = self.appraisal, self._screen()
        return replace(
            self._ready.facts_with(screen.refreshRate(), screen.devicePixelRatio()),
            tick_s=appraisal.tick_s,
            withheld=appraisal.withheld,
            delivery=appraisal.delivery,
            velocity_errors=appraisal.velocity_errors,
        )

    def _show_checks(self) -> None:
        try:
            facts = self._facts
        except StudyError as error:  # the screen was removed
            self._timer.stop()
            self.failed.emit(error)
            return
        self._outlets_shown = facts.outlets
        error_n, now = self.appraisal.error_n, datetime.now().astimezone()
        asked_error = error_n is not None or not self.appraisal.is_over
        planned = planned_rows(self._protocol, now, error_n, asked_error=asked_error)
        results, rows = preflight_checks(facts, self._protocol), (*self._resumption, *planned)
        self.window.show_view(
            PreflightView(self._protocol.study.name, self._who, facts, results, rows, busy=self.measuring.busy)
        )

    def _watch_servo_and_screen(self) -> None:
        """Check that servo and screen are still available, and read the appraiser's answers."""
        try:
            self._ready.rig.servo.check()
            self._screen()
        except StudyError as error:
            self._timer.stop()
            self.failed.emit(error)
            return
        if self._ready.outlet_statuses != self._outlets_shown:  # such as a recording program that connected
            self._show_checks()
        if self._appraised:
            return
        self._appraised = self.appraisal.is_over
        if self.appraisal.read_answers() or self._appraised:
            self._show_checks()

    def _measure_again(self) -> None:
        """Measure again in a separate thread, since the measurement takes two seconds."""
        if not self.measuring.busy:
            ready, sleep = self._ready, self._ending.wait
            self.measuring.run(lambda: measure_rig(ready.rig, self._chosen, ready.videos, sleep=sleep))
            self._show_checks()

    def _apply_measurements(self, facts: Measurements) -> None:
        self._ready = replace(self._ready, facts=facts)
        if _dynamics(facts, self._protocol) != self.appraisal.dynamics:  # the withheld force depends on the delay
            self.appraisal.close()
            self.appraisal, self._appraised = _start_appraisal(self._protocol, facts), False
        self._show_checks()

    def _accept(self) -> None:
        facts = replace(self._ready.facts, tick_s=self.appraisal.tick_s)
        masking = None if self.window.masking is None else self.window.masking.answer()
        self.started.emit(replace(self._ready, facts=facts, masking=masking))


def _start_appraisal(protocol: Protocol, facts: Measurements) -> Appraisal:
    """Start the appraisal of a study on the measured device."""
    return Appraisal(study_scenes(protocol), _dynamics(facts, protocol), DeliveryQuestion(protocol, facts.delay_ticks))


def _resumption_rows(chosen: NewSession, protocol: Protocol) -> tuple[tuple[str, str], ...]:
    """Return the rows about where a session resumes and what is kept; none for a new session."""
    if chosen.resumes is None:
        return ()
    protocol = session_protocol(StudyFolder(chosen.results), protocol, chosen.participant, chosen.session)
    lines = journal.read(locate_session(chosen.resumes)[1].journal)
    schedule = begun_schedule(protocol, start_of(lines), read_key(chosen.results))
    return resumed_rows(protocol, schedule, lines)


def _largest_error_n(errors_n: list[float | None]) -> float | None:
    """Return the largest error [N], or None if one is unknown, since that may be the largest."""
    known = [error for error in errors_n if error is not None]
    return max(known, default=None) if len(known) == len(errors_n) else None


def _dynamics(facts: Measurements, protocol: Protocol) -> Dynamics:
    """Return the device's dynamics, with the servo's current delay if the device measures it."""
    if facts.dynamics.delay_s is None:
        return facts.dynamics
    return facts.dynamics._replace(delay_s=facts.delay_ticks / protocol.device.rate_hz)


def study_scenes(protocol: Protocol) -> tuple[SceneQuestion, ...]:
    """Return the study's scenes with a single liquid, without duplicates, each with the fastest stroke in it."""
    scenes: dict[Scene, SceneQuestion] = {}
    for block in protocol.blocks.values():
        stroke = protocol.tasks[block.task].fastest_stroke(protocol.device.workspace_m)
        for condition in protocol.conditions_in(block.id):
            scene = protocol.scene_for(condition)
            if len(scene.liquids) != 1:
                continue
            known = scenes.get(scene)
            if known is None or stroke.speed_mps > known.stroke.speed_mps:
                scenes[scene] = SceneQuestion(scene.liquids[0].id, scene, stroke)
    return tuple(scenes.values())


MEASURED_S = 2.0
STUDY = "demo"


class ComputerCheck(QObject):
    """Runs the checks of this computer in the background, and shows the results in its window."""

    _compiled = Signal(float)

    def __init__(self, parent: QWidget, theme: Theme, results: Path, screen: QScreen) -> None:
        super().__init__(parent)
        self._results, self._screen = results, Screen(screen.refreshRate(), screen.devicePixelRatio())
        self.window = ComputerWindow(parent, theme)
        self._background = Background(self)
        self._background.done.connect(self._show_checks)
        self._background.failed.connect(self._show_error)
        self._compiled.connect(self.window.show_compiled, Qt.ConnectionType.QueuedConnection)
        self.window.asked.connect(self.measure)
        self.window.finished.connect(self._close)
        self._closed = False

    def measure(self) -> None:
        self.window.show_measuring()
        self._background.run(self._run_checks)

    def _run_checks(self) -> tuple[Check, ...]:
        from study_app.devices.registry import backends  # noqa: PLC0415 - imports the compiler
        from study_app.devices.rig import open_rig, study_settings  # noqa: PLC0415
        from study_app.haptics.kernels import CACHE, following_compilation  # noqa: PLC0415
        from study_app.protocol.load import load  # noqa: PLC0415
        from study_app.session.preflight_measurements import measure_servo_and_disk  # noqa: PLC0415

        study = load(STUDY)
        with following_compilation(self._compiled.emit) as counter:
            rig = open_rig("scripted", study_settings(study, Random(1)))  # noqa: S311 - a simulated tremor
            try:
                facts = measure_servo_and_disk(
                    rig.servo,
                    self._results,
                    device=rig.device.name,
                    screen=self._screen,
                    participant="P001",
                    recordings=True,
                    lasts_s=MEASURED_S,
                )
            finally:
                rig.stop()
        return computer_checks(facts, study, backends(), cache=CACHE, compiled=counter.compiled)

    def _close(self) -> None:
        """Delete this object and its window, after a running measurement, which uses them."""
        self._closed = True
        if not self._background.busy:
            self.window.deleteLater()
            self.deleteLater()

    def _show_error(self, error: BaseException) -> None:
        if self._closed:
            self._close()
        else:
            bug = f"{type(error).__name__}: {error}; the terminal shows the details"
            self.window.show_sentence(f"{error if isinstance(error, StudyError) else bug}.")

    def _show_checks(self, results: tuple[Check, ...]) -> None:
        if self._closed:
            self._close()
        else:
            self.window.show_checks(results)
