"""Compilation of the force model in the background, while the main window is open."""

import logging
import threading
from collections.abc import Callable
from typing import Final

from PySide6.QtCore import QObject, QTimer

from study_app.session.compile_worker import CompilationClient, start_compilation

_POLL_MS: Final = 200
log = logging.getLogger(__name__)


class Compilation(QObject):
    """Compiles the force model in a separate process, for which a session waits that begins meanwhile."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.share = 0.0
        self._client: CompilationClient | None = None
        self._ended = threading.Event()
        self._ended.set()
        self._timer = QTimer(self, interval=_POLL_MS)
        self._timer.timeout.connect(self._read_answers)

    def start(self) -> None:
        """Start compiling, unless the result exists or cannot be stored."""
        try:
            self._client = start_compilation()
        except OSError as error:
            log.warning("the force model is not compiled in the background: %s", error)
        if self._client is not None:
            self._ended.clear()
            self._timer.start()

    def wait(self, progress: Callable[[float], object], is_cancelled: Callable[[], bool]) -> None:
        """Wait, in another thread, until it has ended or is cancelled; report the fraction done (0 to 1)."""
        while not is_cancelled() and not self._ended.wait(_POLL_MS / 1e3):
            progress(self.share)

    def close(self) -> None:
        """End the process."""
        self._timer.stop()
        if self._client is not None:
            self._client.close()
        self._ended.set()

    def _read_answers(self) -> None:
        assert self._client is not None  # noqa: S101 - the timer starts with it
        for _, answer in self._client.answers():
            if isinstance(answer, float):
                self.share = answer
            else:  # done, or failed; then the session compiles
                self.close()
