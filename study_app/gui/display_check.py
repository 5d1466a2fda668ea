"""Check whether a window can be opened before Qt is loaded: without a display, Qt aborts the program.

This module must not import Qt.
"""

import ctypes
import importlib.util
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from study_app.errors import DisplayError

# What Qt's window system needs on Debian and its relatives, beyond a minimal installation.
PACKAGES = (
    "libegl1 libgl1 libglib2.0-0 libfontconfig1 libdbus-1-3 libxkbcommon-x11-0 libxcb-cursor0 libxcb-icccm4 "
    "libxcb-image0 libxcb-keysyms1 libxcb-randr0 libxcb-render-util0 libxcb-shape0 libxcb-xinerama0 libxcb-xkb1"
)
_NEEDS_NO_DISPLAY = "liquid-study rehearse, check, export and plot do not need a display"


def check_display(environment: Mapping[str, str] = os.environ, platform: str = sys.platform) -> None:
    """Check whether Qt can open a window; raise DisplayError if not.

    Raises
    ------
    DisplayError
        There is no display, it cannot be reached, or a system library is missing; the message gives the remedy.
    """
    if platform != "linux":
        return
    plugin = environment.get("QT_QPA_PLATFORM", "").partition(":")[0]
    if plugin not in {"", "xcb"}:
        return  # offscreen, wayland, vnc …: requested by name, so Qt reports its own errors
    if plugin == "" and environment.get("WAYLAND_DISPLAY"):
        return
    display = environment.get("DISPLAY", "")
    if not display:
        raise DisplayError(
            "no display is available: DISPLAY and WAYLAND_DISPLAY are not set; start the program from a desktop "
            f"session, or over SSH with ssh -X ({_NEEDS_NO_DISPLAY})"
        )
    _load_plugin()
    _connect_to_display(display)


def missing_window_library() -> str:
    """Return a message about the system library that Qt's X11 plugin lacks, or "". No display is needed."""
    try:
        if _is_linux():
            _load_plugin()
    except DisplayError as error:
        return str(error)
    return ""


def missing_library(error: OSError | ImportError) -> DisplayError:
    """Return the error about a system library that Qt could not load."""
    library = str(error).partition(":")[0]
    if _is_linux():
        return DisplayError(
            f"Qt cannot be loaded: {library} is missing on this system; on Debian or Ubuntu, run "
            f"sudo apt install {PACKAGES} ({_NEEDS_NO_DISPLAY})"
        )
    return DisplayError(f"Qt cannot be loaded ({error}): reinstall liquid-study with pip")


@contextmanager
def report_missing_library() -> Iterator[None]:
    """Raise an import error of the block as a DisplayError that names the missing system library.

    Raises
    ------
    DisplayError
        A system library is missing.
    """
    try:
        yield
    except ImportError as missing:
        raise missing_library(missing) from missing


def _is_linux() -> bool:
    return sys.platform == "linux"


def _load_plugin() -> None:
    """Load Qt's X11 plugin as Qt would; raise DisplayError if a library is missing."""
    package = importlib.util.find_spec("PySide6")
    if package is None or package.origin is None:
        raise DisplayError("PySide6 is not installed: reinstall liquid-study with pip")
    plugin = Path(package.origin).parent / "Qt" / "plugins" / "platforms" / "libqxcb.so"
    if not plugin.exists():
        return  # Qt from system packages has its libraries
    try:
        ctypes.CDLL(str(plugin))
    except OSError as error:
        raise missing_library(error) from error


def _connect_to_display(display: str) -> None:
    try:
        xcb = ctypes.CDLL("libxcb.so.1")
    except OSError as error:
        raise missing_library(error) from error
    xcb.xcb_connect.restype = ctypes.c_void_p
    xcb.xcb_connection_has_error.argtypes = [ctypes.c_void_p]
    xcb.xcb_disconnect.argtypes = [ctypes.c_void_p]
    connection = xcb.xcb_connect(display.encode(), None)
    failed = xcb.xcb_connection_has_error(connection)
    xcb.xcb_disconnect(connection)
    if failed:
        raise DisplayError(
            f"the display {display!r} (DISPLAY) cannot be reached: check that its X server is running and that "
            f"you have access ({_NEEDS_NO_DISPLAY})"
        )
