"""A keyboard under X11: a held key repeats as pairs of a release and a press with equal time stamps, unmarked."""

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QGuiApplication, QKeyEvent, QWindow
from PySide6.QtWidgets import QApplication, QWidget

REPEAT_MS = 40
SCAN_CODES = {
    Qt.Key.Key_Escape: 9, Qt.Key.Key_1: 10, Qt.Key.Key_4: 13, Qt.Key.Key_Backspace: 22, Qt.Key.Key_Return: 36,
    Qt.Key.Key_A: 38, Qt.Key.Key_Space: 65, Qt.Key.Key_Right: 114,
}  # fmt: skip


class Keyboard:
    """Sends keys to the window that has the keyboard; ``time_ms`` stamps them."""

    def __init__(self) -> None:
        self.time_ms = 10_000

    def send(self, kind: QEvent.Type, key: Qt.Key, text: str = "", scan: int | None = None) -> bool:
        """Send an event, and return whether a receiver accepted it; the window may have gone."""
        event = QKeyEvent(
            kind, key, Qt.KeyboardModifier.NoModifier, SCAN_CODES[key] if scan is None else scan, 0, 0, text
        )
        event.setTimestamp(self.time_ms)
        if kind is QEvent.Type.ShortcutOverride:
            event.ignore()
        window = QGuiApplication.focusWindow()
        if window is not None:
            QApplication.sendEvent(window, event)
        return event.isAccepted()

    def press(self, key: Qt.Key, text: str = "", scan: int | None = None) -> None:
        self.send(QEvent.Type.ShortcutOverride, key, text, scan)
        self.send(QEvent.Type.KeyPress, key, text, scan)

    def release(self, key: Qt.Key, text: str = "", scan: int | None = None) -> None:
        self.send(QEvent.Type.KeyRelease, key, text, scan)

    def repeat(self, key: Qt.Key, times: int, text: str = "", scan: int | None = None) -> None:
        for _ in range(times):
            self.time_ms += REPEAT_MS
            self.release(key, text, scan)
            self.press(key, text, scan)

    def hold(self, key: Qt.Key, repeats: int, text: str = "", scan: int | None = None) -> None:
        """Press a key, let it repeat, and let it go."""
        self.press(key, text, scan)
        self.repeat(key, repeats, text, scan)
        self.time_ms += REPEAT_MS
        self.release(key, text, scan)
        self.time_ms += 300


class PressesReceived(QObject):
    """The time stamps [ms] of the key presses that reached widgets and are not marked as repeats, each once."""

    def __init__(self, application: QObject) -> None:
        super().__init__(application)
        self.times_ms: list[int] = []
        application.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802 - Qt calls it
        pressed = isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress and not event.isAutoRepeat()
        if pressed and isinstance(watched, QWidget) and event.timestamp() not in self.times_ms:
            self.times_ms.append(event.timestamp())
        return False


def handle_in_focus(window: QWidget, qtbot: object) -> QWindow:
    """Give the keyboard to ``window``, and return its handle."""
    window.activateWindow()
    handle: QWindow = window.windowHandle()
    qtbot.waitUntil(lambda: QGuiApplication.focusWindow() is handle)  # type: ignore[attr-defined]
    return handle
