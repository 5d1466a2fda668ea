"""A pilot in one window: it goes on by itself after the skipped steps, and is over where it is stopped.

The researcher is participant and operator. Holding Esc in any window, "Stop playing" above the page where all windows
share a screen, closing the participant's window and every failure end the force first, then the session, then the
window; the journal has an end unless the disk took none.
"""

import logging
from collections.abc import Iterator
from typing import Final

from PySide6.QtCore import QEvent, QObject, QTimer

from study_app.app.session.live_session import LiveSession
from study_app.errors import StudyError
from study_app.session.transitions.events import EndRequested, Event, ForceStopped, ResumeRequested
from study_app.session.transitions.state import Phase, SessionState

END_SHOWN_MS: Final = 2500
log = logging.getLogger(__name__)
STOPPED: Final = "stopped while it was played in the study designer"


class PlayedSession(LiveSession):
    """A session that is played from the designer; ``over`` comes once, as of every session."""

    _shown = False

    @property
    def began(self) -> bool:
        return self._shown

    def open_windows(self, made: object) -> Iterator[None]:
        """Open the participant's window alone, and go on without a question."""
        yield from super().open_windows(made)
        assert self.bridge is not None  # noqa: S101 - just made
        self._shown = True
        participant, runner = self.bridge.participant, self.bridge.runner
        participant.installEventFilter(self)
        participant.event.connect(self._hear)
        for stop in (self.bridge.operator, self.bridge.strip):
            if stop is not None:
                stop.stop_asked.connect(self._stop_later)
        runner.on_change(self._follow)
        self._follow(runner.state)
        if runner.state.phase is Phase.PAUSED and runner.state.held is None:
            runner.post(ResumeRequested(self.bridge.parts.clock(), "participant"))

    @property
    def status(self) -> str | None:
        """How the session ended; None where it did not."""
        return None if self.bridge is None else self.bridge.parts.journal.progress.ended

    def stop(self) -> None:
        """Send zero force, end the session, and close its window; before it has begun, give it up."""
        bridge = self.bridge
        if self._closed:
            return
        if bridge is None:
            self.cancel()
            return
        bridge.parts.servo.stop_force()
        try:
            if not bridge.runner.finished:
                bridge.runner.post(EndRequested(bridge.parts.clock(), "aborted", STOPPED))
        except StudyError as error:  # it stays unfinished
            log.warning("the played session has no end: %s", error)
        finally:
            bridge.leave_now()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take the closing of the participant's window as the end of the session."""
        closes = event.type() == QEvent.Type.Close and self.bridge is not None and watched is self.bridge.participant
        if not closes or self.bridge is None or self.bridge.participant.may_close:
            return super().eventFilter(watched, event)
        event.ignore()
        self._stop_later()
        return True

    def _hear(self, event: Event) -> None:
        if isinstance(event, ForceStopped):
            self._stop_later()

    def _follow(self, state: SessionState) -> None:
        if state.phase is Phase.TROUBLE:
            self._stop_later()
        elif state.over:
            QTimer.singleShot(END_SHOWN_MS, self, self._leave)

    def _stop_later(self) -> None:
        """Stop once what is being handled now is over: it may be the window's own event."""
        QTimer.singleShot(0, self, self.stop)

    def _leave(self) -> None:
        if self.bridge is not None and not self._closed:
            self.bridge.leave_now()
