"""What the operator asks for during a session, as events for the runner."""

from collections.abc import Callable

from PySide6.QtCore import QObject

from study_app.app.guarded_slots import guarded_session_slot
from study_app.app.session.parts import Parts
from study_app.errors import StudyError
from study_app.gui.operator.strip import Strip
from study_app.gui.operator.window import OperatorWindow
from study_app.gui.participant.window import ParticipantWindow
from study_app.session.runner import Runner
from study_app.session.transitions.events import EndAsked, ForceStopped, Note, PauseAsked, RepeatAsked, ResumeAsked


class OperatorRequests(QObject):
    """Connects the operator's window, and the strip if there is one, to the runner.

    Parameters
    ----------
    strip : the state in the participant's window, if both windows share one screen
    fail : is called with every exception of a request; ends in zero force
    """

    def __init__(
        self,
        parts: Parts,
        runner: Runner,
        participant: ParticipantWindow,
        operator: OperatorWindow,
        *,
        strip: Strip | None,
        fail: Callable[[BaseException], None],
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._parts = parts
        self._runner = runner
        self._participant = participant
        self._operator = operator
        self._strip = strip
        self._fail = fail
        operator.stop_asked.connect(self._stop_force)
        operator.fade_in_asked.connect(self._resume)
        operator.resume_asked.connect(self._resume)
        operator.pause_asked.connect(self._pause)
        operator.repeat_asked.connect(self._repeat)
        operator.end_asked.connect(self._end)
        operator.note_written.connect(self._note)
        operator.mark_set.connect(self._mark)
        operator.exclude_asked.connect(self._exclude)
        if strip is not None:
            strip.stop_asked.connect(self._stop_force)

    def fail(self, error: BaseException) -> None:
        """Pass on an exception of a request."""
        self._fail(error)

    def record_note(self, text: str) -> None:
        """Write a note to the journal while the session runs; after its end do nothing."""
        if not self._runner.finished:
            self._runner.post(Note(self._parts.clock(), "note", text))

    @guarded_session_slot
    def _stop_force(self) -> None:
        self._parts.servo.stop_force()  # before anything that could fail or wait for the disk
        self._runner.post(ForceStopped(self._parts.clock(), "operator"))

    @guarded_session_slot
    def _resume(self) -> None:
        self._runner.post(ResumeAsked(self._parts.clock(), "operator"))
        if self._strip is not None:
            self._participant.come_forward()

    @guarded_session_slot
    def _pause(self) -> None:
        self._runner.post(PauseAsked(self._parts.clock(), "operator"))

    @guarded_session_slot
    def _repeat(self, reason: str) -> None:
        self._runner.post(RepeatAsked(self._parts.clock(), reason))

    @guarded_session_slot
    def _note(self, text: str) -> None:
        self._runner.post(Note(self._parts.clock(), "note", text))

    @guarded_session_slot
    def _mark(self) -> None:
        self._runner.post(Note(self._parts.clock(), "mark", ""))

    @guarded_session_slot
    def _exclude(self, trial: object, reason: str) -> None:
        """Exclude a trial or the session; if that fails, the session continues, and a message appears."""
        if self._parts.exclude is None:
            return
        try:
            self._parts.exclude(trial if isinstance(trial, int) else None, reason)
        except StudyError as error:
            self._operator.show_message("It was not excluded", f"{error}.")
        else:
            what = f"trial {trial}" if isinstance(trial, int) else "the session"
            self.record_note(f"excluded from the analysis: {what}: {reason}")

    @guarded_session_slot
    def _end(self, status: str, reason: str) -> None:
        self._runner.post(EndAsked(self._parts.clock(), "withdrawn" if status == "withdrawn" else "aborted", reason))
