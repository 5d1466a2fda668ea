"""Real windows on a virtual X display: the display, and the program as a person meets it."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QPoint, QSize
from PySide6.QtWidgets import QAbstractButton, QWidget

COMPILED_S = 180.0  # by then the force model is compiled on any machine
NEEDED = ("Xvfb", "xdotool", "xset")
MISSING = [tool for tool in NEEDED if shutil.which(tool) is None]
needs_display = pytest.mark.skipif(bool(MISSING), reason=f"not installed here: {', '.join(MISSING)}")


@contextmanager
def virtual_display(*more: str, size: tuple[int, int] = (1920, 1080)) -> Iterator[str]:
    """A private virtual X display of a size [px]; ``more`` are arguments of its server.

    It does not begin anew with every last client that goes: that would turn away one that is just coming.
    """
    read_end, write_end = os.pipe()
    width, height = size
    how = ("-screen", "0", f"{width}x{height}x24", "-nolisten", "tcp", "-noreset", *more)
    words_of_xvfb = ["Xvfb", "-displayfd", str(write_end), *how]
    server = subprocess.Popen(
        words_of_xvfb, pass_fds=(write_end,), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    os.close(write_end)
    with os.fdopen(read_end) as numbers:
        number = numbers.readline().strip()
    try:
        yield f":{number}"
    finally:
        server.terminate()
        server.wait(10)


def wait_for(found: Callable[[], object], what: str, seconds: float = 60.0) -> None:
    """Look again and again until ``found()``: another process offers no signal to wait for."""
    deadline, pause = time.perf_counter() + seconds, threading.Event()
    while not found():
        assert time.perf_counter() < deadline, f"waited {seconds:g} s in vain for {what}"
        pause.wait(0.05)


def new_session(window: QWidget) -> Any:
    """Return the button of the study of the thesis in home's window; None while it is not shown."""
    buttons = {button.accessibleName(): button for button in window.findChildren(QAbstractButton)}
    return next((buttons[name] for name in buttons if re.fullmatch("New session of .*, rek2024", name)), None)


class Program:
    """The running program with its windows and files, driven by keys and mouse."""

    def __init__(
        self, display: str, folder: Path, *arguments: str, program: tuple[str, str] = ("-m", "study_app")
    ) -> None:
        self.folder = folder
        self.environment = os.environ | {"DISPLAY": display, "QT_QPA_PLATFORM": "xcb"}
        self.process = subprocess.Popen(
            [sys.executable, *program, *arguments],
            cwd=folder,
            env=self.environment,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def close(self) -> None:
        """Kill the program and its worker processes, which would otherwise finish what they compute."""
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.communicate()

    def xdotool(self, *arguments: str) -> str:
        finished = subprocess.run(
            ["xdotool", *arguments], env=self.environment, capture_output=True, text=True, check=False
        )
        return finished.stdout.strip()

    def window(self, title: str) -> str:
        titles: list[str] = []

        def look() -> list[str]:
            assert self.process.poll() is None, f"{self.process.returncode} {self.process.stderr.read()}"  # type: ignore[union-attr]
            titles[:] = self.xdotool("search", "--onlyvisible", "--name", title).splitlines()
            return titles

        wait_for(look, f"the window {title!r}")
        return titles[-1]

    def window_of(self, title: str, size: QSize) -> str:
        """Wait for a window of this title and size; return its number."""
        windows: list[str] = []

        def look() -> list[str]:
            assert self.process.poll() is None, f"{self.process.returncode} {self.process.stderr.read()}"  # type: ignore[union-attr]
            windows[:] = [window for window in self.windows(title) if QSize(*self.size(window)) == size]
            return windows

        wait_for(look, f"the window {title!r}", COMPILED_S)
        return windows[-1]

    def windows(self, title: str) -> list[str]:
        """Return the windows of this title that are seen."""
        return self.xdotool("search", "--onlyvisible", "--name", title).split()

    def size(self, window: str) -> tuple[int, int]:
        """Return width and height, or 0 if the window has just closed."""
        geometry = dict(
            line.split("=") for line in self.xdotool("getwindowgeometry", "--shell", window).splitlines() if "=" in line
        )
        return int(geometry.get("WIDTH", 0)), int(geometry.get("HEIGHT", 0))

    def click(self, window: str, place: QPoint) -> None:
        self.xdotool("mousemove", "--window", window, str(place.x()), str(place.y()), "click", "1")

    def click_until(self, window: str, place: QPoint, title: str) -> str:
        """Click until a window of this title is shown: a click before its button is there has no effect."""

        def click() -> bool:
            self.click(window, place)
            deadline = time.perf_counter() + 3.0
            while not self.windows(title) and time.perf_counter() < deadline:
                threading.Event().wait(0.1)
            return bool(self.windows(title))

        wait_for(click, f"the window {title!r}")
        return self.windows(title)[-1]

    def key(self, window: str, *keys: str) -> None:
        self.xdotool("windowfocus", "--sync", window, "key", "--clearmodifiers", *keys)

    def events(self, kind: str) -> list[dict[str, object]]:
        """Return the events of a kind in the journal of the only session."""
        journals = list(self.folder.glob("results/*/data/sub-*/ses-01/journal.jsonl"))
        whole = journals[0].read_bytes().rpartition(b"\n")[0].splitlines() if journals else []
        return [event for event in map(json.loads, whole) if event["event"] == kind]

    def wait_for_event(self, kind: str, count: int = 1) -> None:
        wait_for(lambda: len(self.events(kind)) >= count, f"{count} × {kind!r} in the journal", 90.0)
