"""Keep the screen and the computer awake while a session runs."""

import ctypes
import os
import sys
from pathlib import Path
from typing import Any, Final

_REASON: Final = "a session is running"
CONTINUOUS, SYSTEM, DISPLAY = 0x80000000, 0x1, 0x2  # flags of SetThreadExecutionState
USER_INITIATED, LATENCY_CRITICAL, SCREEN_ON = 0x00FFFFFF, 0xFF00000000, 1 << 40  # options of NSProcessInfo's activities
_CONNECTION: Final = "liquid-study-awake"
_PATIENCE_MS: Final = 1000  # timeout for a desktop that does not answer


class Awake:
    """Prevents sleep between `begin` and `end`, if the system supports this."""

    def __init__(self) -> None:
        self._activity: int | None = None

    def begin(self) -> bool:
        """Keep screen and computer awake; return whether that succeeded.

        On Windows, `begin` and `end` must be called in the same thread.
        """
        if sys.platform == "win32":
            return _set_execution_state(CONTINUOUS | SYSTEM | DISPLAY)
        if sys.platform == "darwin":
            self._activity = _begin_activity()
            return bool(self._activity)
        return _inhibit_screen_saver()

    def end(self) -> None:
        """Let screen and computer sleep again."""
        if sys.platform == "win32":
            _set_execution_state(CONTINUOUS)
        elif sys.platform == "darwin" and self._activity:
            _send(_process_info_object(), "endActivity:", ctypes.c_void_p(self._activity))
            self._activity = None
        elif sys.platform == "linux":
            from PySide6.QtDBus import QDBusConnection  # noqa: PLC0415 - only sessions need it

            QDBusConnection.disconnectFromBus(_CONNECTION)  # which ends the inhibition


def _set_execution_state(state: int) -> bool:
    windows: Any = getattr(ctypes, "windll", None)
    return windows is not None and bool(windows.kernel32.SetThreadExecutionState(ctypes.c_uint(state)))


def _inhibit_screen_saver() -> bool:
    """Ask the desktop's service (GNOME, KDE, Xfce …) not to blank the screen as long as the connection lasts."""
    runtime = os.environ.get("XDG_RUNTIME_DIR", "")
    if "DBUS_SESSION_BUS_ADDRESS" not in os.environ and not (runtime and Path(runtime, "bus").exists()):
        return False
    from PySide6.QtDBus import QDBus, QDBusConnection, QDBusMessage  # noqa: PLC0415 - only sessions need it

    bus = QDBusConnection.connectToBus(QDBusConnection.BusType.SessionBus, _CONNECTION)
    name = "org.freedesktop.ScreenSaver"
    request = QDBusMessage.createMethodCall(name, "/org/freedesktop/ScreenSaver", name, "Inhibit")
    request.setArguments(["liquid-study", _REASON])
    reply = bus.call(request, QDBus.CallMode.Block, _PATIENCE_MS)
    return reply.type() == QDBusMessage.MessageType.ReplyMessage


def _begin_activity() -> int | None:
    """Begin an activity without App Nap and idle sleep (macOS; untested); return the object that ends it."""
    reason = _send(_find_class("NSString"), "stringWithUTF8String:", ctypes.c_char_p(_REASON.encode()))
    options = ctypes.c_uint64(USER_INITIATED | LATENCY_CRITICAL | SCREEN_ON)
    activity = _send(_process_info_object(), "beginActivityWithOptions:reason:", options, ctypes.c_void_p(reason))
    return _send(activity, "retain") if activity else None


def _process_info_object() -> int | None:
    return _send(_find_class("NSProcessInfo"), "processInfo")


def _find_class(name: str) -> int | None:
    library = _load_objective_c()
    library.objc_getClass.restype = ctypes.c_void_p
    address: int | None = library.objc_getClass(name.encode())
    return address


def _send(receiver: int | None, message: str, *arguments: Any) -> int | None:
    """Send a message to an Objective-C object; return the resulting object."""
    library = _load_objective_c()
    library.sel_registerName.restype = library.objc_msgSend.restype = ctypes.c_void_p
    selector = ctypes.c_void_p(library.sel_registerName(message.encode()))
    result: int | None = library.objc_msgSend(ctypes.c_void_p(receiver), selector, *arguments)
    return result


def _load_objective_c() -> Any:
    return ctypes.CDLL("/usr/lib/libobjc.dylib")
