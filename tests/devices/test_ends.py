"""However a program with a force loop ends, the last force at the device is zero."""

import signal
import sys
import threading

import pytest

from study_app import api
from study_app.errors import StudyError
from tests.benchmarks.devices.ends import DEVICES, WAYS, end_program
from tests.compiled import needs_servo

pytestmark = [needs_servo, pytest.mark.slow, pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")]


@pytest.mark.parametrize("way", ["the block is never left", "SIGQUIT"])
def test_the_last_force_of_a_falcon_is_zero(way: str) -> None:
    end = end_program("falcon-emulated", way)
    assert any(end.before)
    assert end.last == (0.0, 0.0, 0.0)


@pytest.mark.nightly
@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("way", WAYS)
def test_the_last_force_of_every_device_is_zero(device: str, way: str) -> None:
    end = end_program(device, way)
    assert any(end.before)
    assert end.last == (0.0, 0.0, 0.0)


def test_a_loop_that_no_signal_would_end_is_refused() -> None:
    refusals: list[str] = []

    def open_in_thread() -> None:
        try:
            with api.open_force("physical2"):
                pass
        except StudyError as error:
            refusals.append(str(error))

    before = signal.signal(signal.SIGTERM, signal.SIG_DFL)
    try:
        thread = threading.Thread(target=open_in_thread)
        thread.start()
        thread.join()
    finally:
        signal.signal(signal.SIGTERM, before)
    assert refusals == [
        "a force loop cannot be opened in a thread, because a termination request (SIGTERM) would leave the force on: "
        "open it in the main thread, or first install a SIGTERM handler there"
    ]
