"""A device without a watchdog, whose program is killed at any moment: its guard ends the force."""

import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from study_app.devices.registry import open_device
from study_app.errors import DeviceError
from study_app.haptics.kernels.c_functions import READ_LOST
from tests.compiled import needs_servo
from tests.devices.force_dimension.standin import StandIn, needs_standin
from tests.devices.subjects import until, write

pytestmark = [needs_servo, *needs_standin, pytest.mark.slow]

MOMENTS = 50
PROGRAM = """
import sys
from study_app.devices.registry import open_device
from tests.devices.subjects import write
print("opens", flush=True)
device = open_device("force-dimension", options={"dhd-library": sys.argv[1]})
while True:
    write(device, (1.0, 2.0, -3.0))
"""


@pytest.mark.variants(2)
@pytest.mark.parametrize("moment", range(MOMENTS))
def test_a_program_that_is_killed_leaves_no_force(unwatched: StandIn, moment: int) -> None:
    """Half of the moments are within half a second of the opening's begin, half while it pushes."""
    wait_s = random.Random(moment).uniform(0.0, 0.5)  # noqa: S311 - a moment, no secret
    running = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, unwatched.path], cwd=Path(__file__).parents[3], stdout=subprocess.PIPE
    )
    with running:
        assert running.stdout is not None
        assert running.stdout.readline() == b"opens\n"
        if moment % 2:
            until(lambda: unwatched.state["force_n"] == [-3.0, 1.0, 2.0], "it does not push", 20.0)
        time.sleep(wait_s)
        running.send_signal(signal.SIGKILL)
        assert running.wait() == -signal.SIGKILL
    if unwatched.state["force_n"] != [0.0, 0.0, 0.0]:
        until(lambda: unwatched.state["closed"] == 1.0, "it is not closed", 20.0)
        assert (unwatched.state["stopped"], unwatched.state["force_on"]) == (1.0, 0.0)
    assert moment % 2 == 0 or unwatched.state["closed"] == 1.0
    assert unwatched.state["force_n"] == [0.0, 0.0, 0.0]


def test_only_a_device_without_a_watchdog_has_a_guard(unwatched: StandIn) -> None:
    for fault, guarded in (("unwatched", True), ("none", False)):
        unwatched.fault(fault)
        with open_device("force-dimension", options={"dhd-library": unwatched.path}) as device:
            assert device.describe()["guard"] is guarded
            assert (device.describe()["watchdog_s"] is None) is guarded


def test_without_its_guard_it_does_not_push(unwatched: StandIn) -> None:
    device: Any = open_device("force-dimension", options={"dhd-library": unwatched.path})
    assert write(device, (1.0, 0.0, 0.0))[0] == 0
    device.guard.child.kill()
    device.guard.listener.join()
    assert write(device, (1.0, 0.0, 0.0))[0] == READ_LOST
    assert "guard process has died" in device.failure
    assert unwatched.state["force_n"] == [0.0, 0.0, 0.0]
    device.close()


def test_a_device_that_takes_no_end_of_force_is_left_to_its_guard(unwatched: StandIn) -> None:
    device: Any = open_device("force-dimension", options={"dhd-library": unwatched.path})
    write(device, (1.0, 0.0, 0.0))
    unwatched.fault("deaf")
    device.close()
    assert unwatched.state["force_n"] == [0.0, 1.0, 0.0]
    unwatched.fault("unwatched")
    until(lambda: unwatched.state["force_n"] == [0.0, 0.0, 0.0], "the force goes on", 20.0)


def test_a_program_that_cannot_start_a_guard_is_refused(unwatched: StandIn, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(DeviceError, match="guard process for the device 'force-dimension' could not be started"):
        open_device("force-dimension", options={"dhd-library": unwatched.path})
    assert unwatched.state["closed"] == 1.0
