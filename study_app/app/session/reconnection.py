"""Connecting a device again in the background: opening and homing it takes as long as a person does."""

import threading
from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, Qt, Signal

from study_app.errors import StudyError

PATIENCE_S = 20.0


class Reconnection(QObject):
    """Runs ``reconnect`` in a thread, once at a time.

    ``connected(described)`` or ``failed(error)`` comes in the thread of this object; ``line`` is what to show: what is
    being done, or why it failed.

    Parameters
    ----------
    reconnect
        Opens and homes the device and starts its servo at zero force; returns what describes it.
    """

    connected = Signal(object)
    failed = Signal(object)
    _over = Signal(object)

    def __init__(self, reconnect: Callable[[], dict[str, Any]]) -> None:
        super().__init__()
        self._reconnect = reconnect
        self._thread: threading.Thread | None = None
        self.line = ""
        self._over.connect(self._end, Qt.ConnectionType.QueuedConnection)

    @property
    def under_way(self) -> bool:
        """Whether the device is being connected."""
        return self._thread is not None

    def begin(self) -> None:
        """Begin, unless it is under way."""
        if self._thread is None:
            self.line = "Connecting the device …"
            self._thread = threading.Thread(target=self._run, name="reconnecting", daemon=True)
            self._thread.start()

    def wait(self, patience_s: float = PATIENCE_S) -> bool:
        """Wait until the device is left alone, for whoever closes it must be its only user; return whether it is."""
        if self._thread is None:
            return True
        self._thread.join(patience_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            made: object = self._reconnect()
        except Exception as error:  # noqa: BLE001 - handed over: a thread has no caller to raise it to
            made = error
        self._over.emit(made)

    def _end(self, made: object) -> None:
        self._thread, self.line = None, ""
        if not isinstance(made, Exception):
            self.connected.emit(made)
            return
        why = str(made) if isinstance(made, StudyError) else f"{type(made).__name__}: {made}"
        self.line = f"Not connected: {why}."
        self.failed.emit(made)
