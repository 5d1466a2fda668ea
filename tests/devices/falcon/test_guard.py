import os
import signal
import socket
import subprocess
import sys

import pytest

if not hasattr(socket, "AF_UNIX"):
    pytest.skip("no Unix sockets here", allow_module_level=True)

from study_app.devices import guard as guarding
from study_app.devices.falcon.constants import FLAG_HOMING, quiet_packet
from study_app.devices.falcon.transport import PACKETS, send_zero_torque
from study_app.devices.guard import PATIENCE_S, watch_program
from study_app.errors import DeviceError
from tests.devices.falcon.served import ServedTransport, Server

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("falcon_socket")]

ENDS_TORQUE = "tests.devices.falcon.served:end_torque"
QUIET = [quiet_packet(FLAG_HOMING)] * PACKETS
PUSHING = b"<PPPAPPPAPPPABA>"  # 4095 on every motor, homing on

PROGRAM = """
import os, signal, sys
from tests.devices.falcon.served import ServedTransport
from study_app.devices.guard import Guard
transport = ServedTransport(sys.argv[1])
guard = Guard("falcon", {ends_torque!r}, sys.argv[1])
{guarded}
transport.write({packet!r}, 1.0)
print("pushing", flush=True)
{then}
"""


@pytest.fixture
def server(tmp_path):
    with Server(tmp_path / "falcon") as server:
        yield server


def program(bridge, then="sys.stdin.read()", *, guarded=True):
    """Return a program that pushes."""
    start = "guard.start()" if guarded else ""
    code = PROGRAM.format(packet=PUSHING, then=then, guarded=start, ends_torque=ENDS_TORQUE)
    running = subprocess.Popen(
        [sys.executable, "-c", code, bridge], stdin=subprocess.PIPE, stdout=subprocess.PIPE, process_group=0
    )
    assert running.stdout.readline() == b"pushing\n"
    return running


def ended(running):
    code = running.wait(30)
    running.stdin.close()
    running.stdout.close()
    return code


def guard_for(bridge):
    return guarding.Guard("falcon", ENDS_TORQUE, bridge)


@pytest.mark.parametrize("how", [signal.SIGTSTP, signal.SIGTTIN, signal.SIGTTOU])
def test_a_program_that_is_guarded_is_not_suspended_while_it_pushes(server, how):
    running = program(server.path, "sys.stdin.readline(); os.kill(os.getpid(), signal.SIGKILL)")
    running.send_signal(how)
    running.stdin.write(b"\n")
    running.stdin.flush()
    assert not os.WIFSTOPPED(os.waitpid(running.pid, os.WUNTRACED)[1])
    running.kill()
    ended(running)
    server.wait_for(1 + PACKETS)
    assert server.bridge.sent == [PUSHING, *QUIET]


@pytest.mark.parametrize(
    ("then", "code"),
    [
        *((f"os.kill(os.getpid(), signal.{how})", -getattr(signal, how)) for how in ("SIGKILL", "SIGTERM", "SIGABRT")),
        ("sys.exit(3)", 3),
        ("os._exit(7)", 7),
        ("raise SystemError", 1),
    ],
)
def test_a_program_that_is_killed_or_ends_without_a_word_leaves_no_torque(server, then, code, capfd):
    running = program(server.path, then)
    assert ended(running) == code
    server.wait_for(1 + PACKETS)
    assert server.bridge.sent == [PUSHING, *QUIET]
    assert server.bridge.controls == []  # the bridge stays as it was
    capfd.readouterr()


def test_a_program_that_stands_the_guard_down_has_ended_the_force_itself(server):
    running = program(server.path, "transport.close(); guard.stand_down()")
    assert ended(running) == 0
    assert server.bridge.sent == [PUSHING]
    assert server.programs == 1  # nobody else opened it


def test_the_guard_waits_until_the_falcon_is_let_go(server):
    guard = guard_for(server.path)
    guard.start()
    server.refusals = 5
    guard.release()
    assert server.bridge.sent == QUIET
    assert (server.refusals, server.programs) == (0, 1)


def test_a_guard_that_is_left_behind_waits_for_the_falcon_to_come_back(tmp_path):
    guard = guard_for(str(tmp_path / "falcon"))
    guard.start()
    guard.leave()  # and does not wait
    assert not guard.watching
    guard.leave()
    with Server(tmp_path / "falcon") as server:
        server.wait_for(PACKETS)
        assert server.bridge.sent == QUIET


def test_a_guard_that_was_left_behind_is_recalled_when_the_falcon_is_opened_again(tmp_path, capfd):
    guard = guard_for(str(tmp_path / "falcon"))
    guard.start()
    orphan = guard.child
    guard.leave()
    guard.recall()
    guard.recall()
    assert orphan.wait(PATIENCE_S / 2) != 0  # before its patience ends
    assert capfd.readouterr().err == ""


def test_signals_that_end_a_program_do_not_end_its_guard(server):
    guard = guard_for(server.path)
    guard.start()
    child = guard.child
    assert os.getsid(child.pid) != os.getsid(0)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        child.send_signal(number)
    guard.release()
    assert child.returncode == 0
    assert server.bridge.sent == QUIET


def test_a_guard_stands_down_at_a_good_end(server):
    with guard_for(server.path) as guard:
        assert guard.watching
        child = guard.child
        guard.start()
        assert guard.child is child
    assert not guard.watching
    assert child.returncode == 0
    guard.stand_down()
    guard.release()
    assert server.programs == 0


def test_a_guard_acts_at_a_bad_end(server):
    transport = ServedTransport(server.path)

    def fail():
        with guard_for(server.path):
            transport.close()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert server.bridge.sent == QUIET


def test_a_guard_that_died_is_not_watching_and_ends_all_the_same(server):
    guard = guard_for(server.path)
    guard.start()
    child = guard.child
    child.kill()
    child.wait()
    assert not guard.watching
    guard.stand_down()
    assert server.programs == 0


def test_a_falcon_without_a_guard_is_refused(monkeypatch):
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(DeviceError, match="guard"):
        guard_for("falcon").start()


def test_a_missing_falcon_is_reported(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(guarding, "PATIENCE_S", 0.0)
    monkeypatch.setattr(guarding.signal, "signal", lambda *_: None)
    with (tmp_path / "ended").open("w+", encoding="utf-8", newline="\n") as ended_at_once:
        monkeypatch.setattr(guarding.sys, "stdin", ended_at_once)
        assert watch_program("falcon", ENDS_TORQUE, str(tmp_path / "none")) == 2
    said = capsys.readouterr()
    assert said.out == "ready\n"
    assert said.err.startswith("the device 'falcon' may still exert force: ")
    assert said.err.endswith("; turn it off\n")


def test_a_packet_that_does_not_go_out_does_not_keep_the_others_back():
    class Stubborn:
        sent, pauses, tries = [], 0, 0

        def write(self, data, timeout_s):
            self.tries += 1
            if self.tries % 2:
                raise DeviceError("not now")
            self.sent.append(data)

        def pause(self, seconds):
            self.pauses += 1

    stubborn = Stubborn()
    assert send_zero_torque(stubborn) == PACKETS // 2
    assert stubborn.tries == stubborn.pauses == PACKETS
    assert stubborn.sent == QUIET[: PACKETS // 2]


def test_the_guard_loads_no_compiler():
    code = (
        "import sys, study_app.devices.guard, study_app.devices.falcon.transport, "
        "study_app.devices.force_dimension.library; sys.exit(bool({'numba', 'pandas', 'PySide6'} & {*sys.modules}))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_guard_loads_nothing_from_the_folder_it_is_started_in(tmp_path, monkeypatch):
    (tmp_path / "signal.py").write_text("raise SystemExit", encoding="utf-8", newline="\n")
    monkeypatch.chdir(tmp_path)
    with guard_for("falcon") as guard:
        assert guard.watching
