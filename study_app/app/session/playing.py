"""Playback in the study designer: a pilot of the draft from the shown step on, with the simulated hand or a device.

The steps before are skipped, and the pilot ends where it is stopped. The researcher is both participant and operator.
Holding Esc in any window, "Stop playing", closing the participant's window and every failure stop the force first, then
end the session, then close the window.
"""

import logging
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from PySide6.QtCore import QEvent, QObject, QTimer, Signal
from PySide6.QtWidgets import QApplication

from study_app.app.failures import BUG, Patience
from study_app.app.session.live_session import LiveSession
from study_app.designer import header as notices
from study_app.designer.controller import DesignerController
from study_app.designer.header import Notice, PlayDevices
from study_app.designer.participant.playable import NotPlayableError, Playable, StepPosition, part_to_play
from study_app.designer.problems import fault_rows
from study_app.devices.registry import descriptor_of, title_of
from study_app.errors import StoreError, StudyError
from study_app.gui.kit import device_choices, settings_here
from study_app.gui.widgets import Background
from study_app.session.simulated.answers_only import begin_session_at_step
from study_app.session.start import NewSession, resumed_choices
from study_app.session.transitions.events import EndRequested, ForceStopped, ResumeRequested
from study_app.session.transitions.page_builder import PARTICIPANT
from study_app.session.transitions.state import Phase, SessionState
from study_app.store.files import copy_folder, kept_pilot_folder, write_file
from study_app.store.sessions import SessionStart
from study_app.store.versions import keep_content

_END_SHOWN_MS: Final = 2500
log = logging.getLogger(__name__)
_STOPPED: Final = "stopped during playback in the study designer"


class PlayedSession(LiveSession):
    """A session that is played from the designer, without the operator's window."""

    _shown = False

    @property
    def has_begun(self) -> bool:
        return self._shown

    def open_windows(self, ready: object) -> Iterator[None]:
        yield from super().open_windows(ready)
        assert self.bridge is not None  # noqa: S101 - just created
        self._shown = True
        participant, runner = self.bridge.participant, self.bridge.runner
        participant.installEventFilter(self)
        participant.event.connect(lambda event: self._stop_later() if isinstance(event, ForceStopped) else None)
        self.bridge.operator.asked.connect(lambda request, _details: self._stop_later() if request == "stop" else None)
        if self.bridge.strip is not None:
            self.bridge.strip.stop.pressed.connect(self._stop_later)
        runner.on_change(self._follow_state)
        self._follow_state(runner.state)
        if runner.state.phase is Phase.PAUSED and runner.state.held is None:
            runner.post(ResumeRequested(self.bridge.parts.clock(), "participant"))

    @property
    def status(self) -> str | None:
        return None if self.bridge is None else self.bridge.parts.journal.progress.ended

    def stop(self) -> None:
        """Send zero force, end the session and close its window; or cancel a session that has not begun."""
        bridge = self.bridge
        if self._closed:
            return
        if bridge is None:
            self.cancel()
            return
        bridge.parts.servo.stop_force()
        try:
            if not bridge.runner.finished:
                bridge.runner.post(EndRequested(bridge.parts.clock(), "aborted", _STOPPED))
        except StudyError as error:  # the session stays unfinished
            log.warning("the played session does not have an end: %s", error)
        finally:
            bridge.leave_without_asking()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """End the session when the participant's window is closed."""
        closes = event.type() == QEvent.Type.Close and self.bridge is not None and watched is self.bridge.participant
        if not closes or self.bridge is None or self.bridge.participant.may_close:
            return super().eventFilter(watched, event)
        event.ignore()
        self._stop_later()
        return True

    def _follow_state(self, state: SessionState) -> None:
        if state.phase is Phase.TROUBLE:
            self._stop_later()
        elif state.over:
            QTimer.singleShot(_END_SHOWN_MS, self, self._leave_session)

    def _stop_later(self) -> None:
        """Stop after the current event, which the window may still be handling."""
        QTimer.singleShot(0, self, self.stop)

    def _leave_session(self) -> None:
        if self.bridge is not None and not self._closed:
            self.bridge.leave_without_asking()


_SIMULATED: Final = "scripted"
_POLL_S: Final = 0.01
FOLDER: Final = "liquid-study-play-"
_OUTCOMES: Final = {
    "completed": "completed",
    "incomplete": "completed, but some trials were not delivered",
    "aborted": "stopped",
    "withdrawn": "no consent",
    "broken": "failed",
}


@dataclass(slots=True)
class _Pilot:
    """A pilot: the played part of the study, its temporary folder, and its session once that runs."""

    what: Playable
    device: str
    folder: Path
    choices: NewSession | None = None
    session: PlayedSession | None = None


class Playing(QObject):
    """Plays the open study, one pilot at a time; ``kept`` carries the study folder of a pilot that was kept.

    ``where`` returns the preview's position, or None for the first step that shows the selected element.

    Parameters
    ----------
    designer : controller of the study designer, whose open study is played
    """

    kept = Signal(object)

    def __init__(self, designer: DesignerController) -> None:
        editing, place = designer.editing, designer.place
        super().__init__(editing)
        self.editing, self.place = editing, place
        self.where: Callable[[], StepPosition | None] = lambda: designer.preview.position
        self.kept.connect(designer.runs.read_in_background)
        self.device = _SIMULATED
        self.pilot: _Pilot | None = None
        self._part_to_play: Playable | None = None
        self._opening: list[PlayedSession] = []
        self._preparing = Background(self)
        self._preparing.done.connect(self._start_pilot)
        header = place.header
        header.play.asked.connect(self.play)
        header.play.device_chosen.connect(self.choose_device)
        header.strip.asked.connect(self._handle_answer)
        place.left.connect(self.stop)
        place.entered.connect(self._show_devices)
        editing.opened_other.connect(self._discard_pilot)

    @property
    def is_under_way(self) -> bool:
        return self._preparing.busy or (self.pilot is not None and self.pilot.session is not None)

    # requests

    def choose_device(self, name: str) -> None:
        self.device = name
        self._show_devices()

    def play(self) -> None:
        """Play from the shown step, unless the study has problems from there on; ask before a device is used."""
        self.place.flush()
        self.editing.leave_entries()
        opened = self.editing.opened
        if opened is None or self.is_under_way:
            return
        study = opened.study
        try:
            playable_part = part_to_play(study, opened.selected, self.where())
        except NotPlayableError as error:
            names = {str(problem): row.name for problem, row in zip(study.problems, fault_rows(study), strict=True)}
            named = (replace(problem, place=names.get(str(problem), problem.place)) for problem in error.problems)
            self._show_notice(notices.refusal_notice(tuple(map(str, named))))
            return
        self._part_to_play = playable_part
        if self.device == _SIMULATED:
            self._prepare_pilot()
        else:
            has_force = descriptor_of(self.device).kind == "felt"
            self._show_notice(notices.device_question(title_of(self.device), playable_part.words, has_force=has_force))

    def stop(self) -> None:
        """Stop the pilot, with zero force first."""
        if self.pilot is not None and self.pilot.session is not None:
            self.pilot.session.stop()
        elif self._preparing.busy:
            self.pilot = None  # `_start_pilot` deletes its folder once the preparation has ended
            self._show_notice(None)
        elif self.pilot is not None and self.pilot.choices is None:  # a bug ended its preparation
            self._delete_data()
            self._show_notice(None)

    def _handle_answer(self, action: str) -> None:
        if action == "play":
            self._prepare_pilot()
        elif action == "stop":
            self.stop()
        elif action == "keep":
            self._keep_data()
        else:
            if action == "problems":
                self.place.problems.show()
            self._delete_data()
            self._show_notice(None)

    # pilots

    def _prepare_pilot(self) -> None:
        """Simulate the skipped steps in the background."""
        self._delete_data()
        part, self._part_to_play = self._part_to_play, None
        if part is None:
            return
        try:
            folder = Path(tempfile.mkdtemp(prefix=FOLDER))
        except OSError as error:
            self.place.message.emit(
                "The study cannot be played", f"A temporary folder cannot be created: {error.strerror}."
            )
            return
        pilot = self.pilot = _Pilot(part, self.device, folder)
        self._preparing.run(lambda: _prepare_session(pilot))
        self._show_notice(notices.playing_notice(part.words, title_of(pilot.device)))

    def _start_pilot(self, outcome: tuple[_Pilot, NewSession | StudyError]) -> None:
        pilot, choices = outcome
        if pilot is not self.pilot:  # it was stopped meanwhile
            _remove_folder(pilot.folder)
            self.place.header.play.show_playing(self.is_under_way)
            return
        if isinstance(choices, StudyError):
            self._delete_data()
            self._show_notice(None)
            self.place.message.emit("The study cannot be played", f"{choices}.")
            return
        pilot.choices = choices
        pilot.session = PlayedSession(choices, self.place.theme)
        pilot.session.over.connect(self._finish_pilot)
        pilot.session.open()

    def _finish_pilot(self) -> None:
        pilot = self.pilot
        if pilot is None or pilot.session is None:
            return
        session, pilot.session = pilot.session, None
        self._opening = [earlier for earlier in (*self._opening, session) if earlier.is_opening]
        if session.error is not None:
            self.place.message.emit("Playback was stopped", f"{session.error}.")
        elif session.code == BUG:
            self.place.message.emit("A bug in the program stopped the pilot", "The terminal shows the details.")
        if session.has_begun:
            self._show_notice(notices.ended_notice(pilot.what.words, _OUTCOMES.get(session.status or "", "stopped")))
        else:
            self._delete_data()
            self._show_notice(None)

    def _keep_data(self) -> None:
        pilot = self.pilot
        if pilot is None or pilot.choices is None or pilot.session is not None:
            return
        target = kept_pilot_folder(self.editing.results, pilot.what.protocol.study.name)
        try:
            copy_folder(pilot.choices.results, target)
        except StudyError as error:
            self.place.message.emit("The pilot was not saved", f"{error}.")
            return
        with suppress(StoreError):  # the copy is only for the tab Changes
            keep_content(pilot.what.source)
        self._delete_data()
        self._show_notice(notices.kept_notice(target.name))
        self.kept.emit(target)

    def end_by_signal(self, number: int) -> None:
        if self.pilot is not None and self.pilot.session is not None:
            self.pilot.session.end_by_signal(number)

    def end(self, patience: Patience) -> None:
        """Stop the pilot, wait for devices that are being opened, and delete the pilot's data."""
        self.stop()
        while self._preparing.busy and patience.left_s > 0:
            QApplication.processEvents()
            time.sleep(_POLL_S)
        for session in self._opening:
            session.wait(patience.left_s)
        self._delete_data()

    def _discard_pilot(self) -> None:
        self.stop()
        self._delete_data()
        self._part_to_play = None
        self._show_notice(None)

    def _delete_data(self) -> None:
        pilot, self.pilot = self.pilot, None
        if pilot is not None:
            _remove_folder(pilot.folder)

    # display

    def _show_notice(self, state: Notice | None) -> None:
        self.place.header.strip.show_notice(state)
        self.place.header.play.show_playing(self.is_under_way)

    def _show_devices(self) -> None:
        self.place.header.play.show_devices(PlayDevices(device_choices(), self.device))


def _prepare_session(pilot: _Pilot) -> tuple[_Pilot, NewSession | StudyError]:
    """Create a session from the pilot's first step on; return the pilot, and the session's choices or the error."""
    part, study = pilot.what, pilot.what.protocol.study
    file = pilot.folder / f"{study.name}.toml"
    start = SessionStart(
        PARTICIPANT,
        seed=part.position.seed,
        operator="",
        language=part.position.language,
        device={"name": pilot.device},
        screens={"participant": "simulated", "steps": part.step},
        simulated=True,
        pilot=True,
    )
    try:
        write_file(file, part.source, waits=False)
        session = begin_session_at_step(
            pilot.folder / "results" / study.name, part.protocol, part.source, start, part.step
        )
        options = descriptor_of(pilot.device).window_values(settings_here()[0].device_options)
        choices = resumed_choices(
            session, protocol=str(file), device=pilot.device, windowed=True, device_options=options
        )
        return pilot, replace(choices, played=True, footage=part.folder)
    except StudyError as error:
        return pilot, error


def _remove_folder(folder: Path) -> None:
    """Delete the data of a pilot."""
    shutil.rmtree(folder, ignore_errors=True)
