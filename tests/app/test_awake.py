"""Screen and computer stay awake during a session: the requests to each system, and their release."""

import ctypes
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from study_app.app.awake import CONTINUOUS, DISPLAY, LATENCY_CRITICAL, SCREEN_ON, SYSTEM, USER_INITIATED, Awake

SERVICE = """
from PySide6.QtCore import ClassInfo, QCoreApplication, QObject, Slot
from PySide6.QtDBus import QDBusConnection

@ClassInfo({"D-Bus Interface": "org.freedesktop.ScreenSaver"})
class Saver(QObject):
    @Slot(str, str, result="uint")
    def Inhibit(self, program, reason):
        print("inhibited", program, reason, flush=True)
        return 7

application = QCoreApplication([])
bus = QDBusConnection.sessionBus()
saver = Saver()
bus.registerObject("/org/freedesktop/ScreenSaver", saver, QDBusConnection.RegisterOption.ExportAllSlots)
bus.registerService("org.freedesktop.ScreenSaver")
print("ready", flush=True)
application.exec()
"""


def test_windows_is_asked_to_stay_awake_and_released(monkeypatch: pytest.MonkeyPatch) -> None:
    states: list[int] = []
    kernel = SimpleNamespace(SetThreadExecutionState=lambda state: states.append(state.value) or 1)
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setattr(ctypes, "windll", SimpleNamespace(kernel32=kernel), raising=False)
    held = Awake()
    assert held.begin()
    held.end()
    assert states == [CONTINUOUS | SYSTEM | DISPLAY, CONTINUOUS]


class ObjectiveC:
    """Objects of Objective-C by number; ``sent`` lists the messages."""

    def __init__(self) -> None:
        self.names: list[str] = [""]
        self.sent: list[tuple[str, str, list[Any]]] = []
        self.objc_getClass = self.sel_registerName = partial(self._number)  # objects with attributes, as of ctypes
        self.objc_msgSend = partial(self._send)

    def _number(self, name: bytes) -> int:
        self.names.append(name.decode())
        return len(self.names) - 1

    def _send(self, receiver: Any, selector: Any, *arguments: Any) -> int:
        message = self.names[selector.value]
        self.sent.append((self.names[receiver.value], message, [value.value for value in arguments]))
        return self._number(f"result of {message}".encode())


def test_macos_begins_an_activity_and_ends_the_same_one(monkeypatch: pytest.MonkeyPatch) -> None:
    double = ObjectiveC()
    monkeypatch.setattr(sys, "platform", "darwin")
    monkeypatch.setattr(ctypes, "CDLL", lambda _: double)
    held = Awake()
    assert held.begin()
    held.end()
    messages = [(receiver, message) for receiver, message, _ in double.sent]
    assert messages[-4:] == [
        ("result of processInfo", "beginActivityWithOptions:reason:"),
        ("result of beginActivityWithOptions:reason:", "retain"),
        ("NSProcessInfo", "processInfo"),
        ("result of processInfo", "endActivity:"),
    ]
    options, _ = next(arguments for _, message, arguments in double.sent if message.startswith("begin"))
    assert options == USER_INITIATED | LATENCY_CRITICAL | SCREEN_ON
    (ended,) = double.sent[-1][2]
    assert double.names[ended] == "result of retain"


@pytest.fixture
def bus(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Run a session bus of our own."""
    if sys.platform != "linux" or shutil.which("dbus-daemon") is None:
        pytest.skip("dbus-daemon is not installed")
    command = ["dbus-daemon", "--session", "--nofork", "--print-address=1"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as daemon:
        assert daemon.stdout is not None
        address = daemon.stdout.readline().strip()
        monkeypatch.setenv("DBUS_SESSION_BUS_ADDRESS", address)
        try:
            yield address
        finally:
            daemon.kill()


def count_programs(address: str) -> int:
    """Return the number of programs on a bus, with this request itself."""
    command = ["gdbus", "call", "--address", address, "-d", "org.freedesktop.DBus", "-o", "/", "-m"]
    listed = subprocess.run([*command, "org.freedesktop.DBus.ListNames"], capture_output=True, text=True, check=True)
    return len(re.findall("':[^']+'", listed.stdout))


@pytest.mark.skipif(shutil.which("gdbus") is None, reason="gdbus is not installed")
def test_the_service_of_the_desktop_inhibits_until_the_connection_ends(bus: str) -> None:
    held = Awake()
    assert not held.begin(), "there is no such service"
    held.end()
    with subprocess.Popen([sys.executable, "-c", SERVICE], stdout=subprocess.PIPE, text=True) as service:
        try:
            assert service.stdout is not None
            assert service.stdout.readline() == "ready\n"
            before = count_programs(bus)
            assert held.begin()
            assert service.stdout.readline() == "inhibited liquid-study a session is running\n"
            assert count_programs(bus) == before + 1
            held.end()
            assert count_programs(bus) == before
        finally:
            service.kill()


def test_without_a_session_bus_nothing_is_asked(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DBUS_SESSION_BUS_ADDRESS", raising=False)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    held = Awake()
    assert not held.begin()
    held.end()
