"""Key presses: every window of the program receives one press and one release per physical key press.

X11 repeats a held key as pairs of a release and a press with equal time stamps, and Qt marks few of them as
`isAutoRepeat`. A real press comes later than the release before it, so equal time stamps tell the two apart.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from PySide6.QtCore import QEvent, QObject, Qt, QTimer, Signal
from PySide6.QtGui import QGuiApplication, QKeyEvent, QWindow
from PySide6.QtWidgets import QWidget

RELEASE_MS: Final = 30  # a release is real unless a press with its time stamp follows within this time
CLICK_MS: Final = 250  # time during which a new page ignores clicks
_REPEATING_KEYS: Final = frozenset({
    Qt.Key.Key_Left, Qt.Key.Key_Right, Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_PageUp, Qt.Key.Key_PageDown,
    Qt.Key.Key_Backspace, Qt.Key.Key_Delete,
})  # fmt: skip
_SINGLE_KEYS: Final = frozenset(
    {Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Escape, Qt.Key.Key_Tab, Qt.Key.Key_Backtab}
)
"""Keys that do not repeat, even in text fields."""
_SHIELD: Final = Qt.WidgetAttribute.WA_TransparentForMouseEvents
_MODIFIERS: Final = (
    Qt.KeyboardModifier.ShiftModifier
    | Qt.KeyboardModifier.ControlModifier
    | Qt.KeyboardModifier.AltModifier
    | Qt.KeyboardModifier.MetaModifier
)


class _Release(NamedTuple):
    key: int
    event: QKeyEvent


class KeyPresses(QObject):
    """Filters the keys of the focused window before the window and its shortcuts receive them.

    A repeat reaches only the widget that received the press, and only if it types text or the key moves something; it
    is then marked as `isAutoRepeat`. Shortcuts act once per press. ``changed(window, event)`` carries every real press
    and, up to 30 ms late, every real release.
    """

    changed = Signal(object, object)

    def __init__(self, application: QGuiApplication) -> None:
        super().__init__(application)
        self._window: QWindow | None = None
        self._receivers: dict[int, QObject | None] = {}  # the delivered presses by key
        self._release: _Release | None = None  # the last release, until it is known to be real
        self._event_sent: QKeyEvent | None = None  # the event that this filter is sending
        self._release_timer = QTimer(self, singleShot=True, interval=RELEASE_MS)
        # An overdue timer may fire before a queued press; a zero timer fires after it.
        self._release_timer.timeout.connect(lambda: QTimer.singleShot(0, self, self._deliver_if_due))
        application.focusWindowChanged.connect(self._watch_window)
        self._watch_window(application.focusWindow())

    def begin_page(self, page: QWidget) -> None:
        """Ignore keys that are still held from the previous page, and clicks within 250 ms."""
        self._receivers.clear()
        page.setAttribute(_SHIELD)
        unshield = QTimer(page, singleShot=True, interval=CLICK_MS)
        unshield.timeout.connect(lambda: page.setAttribute(_SHIELD, False))
        unshield.timeout.connect(unshield.deleteLater)
        QTimer.singleShot(0, unshield, unshield.start)  # once the page is painted

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if not isinstance(event, QKeyEvent) or event is self._event_sent:
            return False
        if event.type() == QEvent.Type.KeyRelease:
            return self._hold_release(event)
        if event.type() not in {QEvent.Type.KeyPress, QEvent.Type.ShortcutOverride}:
            return False
        key = _physical_key(event)
        repeats = event.isAutoRepeat() or self._is_key_repeat(key, event)
        if not repeats:
            self._deliver_release()
        if event.type() == QEvent.Type.ShortcutOverride:
            if repeats:
                event.accept()  # so that no shortcut acts
            else:
                self._receivers.pop(key, None)
            return repeats
        if repeats:
            self._release = None
            self._send_repeat(watched, key, event)
            return True
        self._receivers[key] = QGuiApplication.focusObject()
        self.changed.emit(watched, event)
        return False

    def _watch_window(self, window: QWindow | None) -> None:
        """Filter the events of the focused window, the only one that receives keys."""
        if window is not None and window is not self._window:
            window.removeEventFilter(self)  # a window that becomes active again is filtered once
            window.installEventFilter(self)
        self._window = window

    def _is_key_repeat(self, key: int, event: QKeyEvent) -> bool:
        release = self._release
        return release is not None and release.key == key and release.event.timestamp() == event.timestamp()

    def _send_repeat(self, window: QObject, key: int, event: QKeyEvent) -> None:
        """Send a repeat, marked as such, to the widget that received the press."""
        receiver = QGuiApplication.focusObject()
        if receiver is None or self._receivers.get(key) is not receiver:
            return
        if event.key() in _REPEATING_KEYS or (event.key() not in _SINGLE_KEYS and _accepts_text(receiver)):
            self._send_event(window, _as_repeat(event))

    def _hold_release(self, event: QKeyEvent) -> bool:
        """Hold back a release until it is known to be real; pass on releases that no keyboard caused."""
        if event.isAutoRepeat():
            return True
        self._deliver_release()
        if event.nativeScanCode():
            self._release = _Release(_physical_key(event), event.clone())
            self._release_timer.start()
            return True
        self.changed.emit(self._window, event)
        return False

    def _deliver_if_due(self) -> None:
        if not self._release_timer.isActive():
            self._deliver_release()

    def _deliver_release(self) -> None:
        """Deliver the release that was held back, if any."""
        release, self._release = self._release, None
        if release is None:
            return
        self._receivers.pop(release.key, None)
        window = QGuiApplication.focusWindow()
        self.changed.emit(window, release.event)
        if window is not None:
            self._send_event(window, release.event)

    def _send_event(self, window: QObject, event: QKeyEvent) -> None:
        self._event_sent = event
        QGuiApplication.sendEvent(window, event)
        self._event_sent = None


def key_presses() -> KeyPresses:
    """Return the application's key filter, creating it on first use."""
    application = QGuiApplication.instance()
    assert isinstance(application, QGuiApplication)  # noqa: S101  # windows need one
    return application.findChild(KeyPresses) or KeyPresses(application)


def ignores_clicks(page: QWidget) -> bool:
    """Return whether ``page`` is so new that a click must have been meant for the previous page."""
    return page.testAttribute(_SHIELD)


def digit_of(event: QKeyEvent) -> int | None:
    """Return the digit on a key, also in layouts that need Shift for digits; None for other keys."""
    if Qt.Key.Key_0 <= event.key() <= Qt.Key.Key_9:
        return event.key() - Qt.Key.Key_0
    first_code = 2 if QGuiApplication.platformName() == "windows" else 10  # scan code of the key 1: PC; X11 and Wayland
    position = event.nativeScanCode() - first_code
    return (position + 1) % 10 if 0 <= position < 10 and not event.modifiers() & _MODIFIERS else None


def _physical_key(event: QKeyEvent) -> int:
    """Return the scan code of a key, independent of modifiers, or its key code if no keyboard caused the event."""
    return event.nativeScanCode() or -event.key()


def _accepts_text(receiver: QObject) -> bool:
    return isinstance(receiver, QWidget) and receiver.testAttribute(Qt.WidgetAttribute.WA_InputMethodEnabled)


def _as_repeat(event: QKeyEvent) -> QKeyEvent:
    repeat = QKeyEvent(
        event.type(), event.key(), event.modifiers(), event.nativeScanCode(), event.nativeVirtualKey(),
        event.nativeModifiers(), event.text(), True, event.count(),
    )  # fmt: skip
    repeat.setTimestamp(event.timestamp())
    return repeat
