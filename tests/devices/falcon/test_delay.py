"""The delay of replies, measured during operation: a slower link is detected soon, a lost reply is ignored."""

from random import Random

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("the exchange is made of C functions", allow_module_level=True)

from study_app.devices.emulators.falcon import EmulatedFalcon
from study_app.devices.emulators.falcon_emulator import Emulator
from study_app.haptics.kernels.c_functions import READ_NEW
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo
from tests.devices.falcon.support.scripted_bridge import Ticks, reply

SLOWER_READS, FASTER_READS, GIVEN_UP_READS, RETEST_TICKS = 8, 200, 32, 30
"""After how many reads a slower and a quicker link and one that cannot be measured are seen, and it is looked again."""


class Link(Ticks):
    """Ticks whose packets are answered ``delay`` reads later, each reply lost or sent twice by chance."""

    def __init__(self, lost=0.0, twice=0.0):
        super().__init__()
        self._random, self._lost, self._twice = Random(3), lost, twice  # noqa: S311
        self._due: list[int] = []
        self.open_gate()

    def run(self, ticks, delay, swinging_n=0.0):
        """Return the reported delay at each of this number of reads, or -1 without a new sample."""
        delays = []
        for _ in range(ticks):
            now = self.now_ns // 10**6
            before = len(self.bridge.sent)
            came = [reply()] * sum(due <= now for due in self._due)
            self._due = [due for due in self._due if due > now]
            self.reading[0].delay_ticks = -1
            force_n = swinging_n * np.array([1.0, 0.0, 0.0]) * (1 + now % 2)
            answer, _ = self.tick(*came[:3], force_n=tuple(force_n))
            delays.append(int(self.reading[0].delay_ticks) if answer == READ_NEW else -1)
            if len(self.bridge.sent) > before and self._random.random() >= self._lost:
                self._due += [now + delay] * (1 + (self._random.random() < self._twice))
        return delays


@pytest.mark.parametrize("delay", [2, 3, 4])
def test_a_link_that_becomes_slower_is_seen_within_some_tens_of_ticks(delay):
    link = Link()
    assert set(link.run(200, 1)[100:]) == {1}
    delays = link.run(100, delay)
    first = delays.index(delay)
    assert first <= SLOWER_READS + 3 * delay + 2
    assert set(delays[first:]) == {delay}


def test_a_link_that_becomes_slower_is_seen_while_the_force_changes_too_fast_for_a_measurement():
    link = Link()
    link.run(200, 1)
    delays = link.run(100, 3, swinging_n=3.0)
    assert delays.index(3) <= GIVEN_UP_READS + 5
    assert delays.count(-1) < 10


def test_a_link_that_becomes_quicker_again_is_seen():
    link = Link()
    link.run(200, 3)
    delays = link.run(2 * FASTER_READS, 1)
    assert delays.index(1) <= FASTER_READS + RETEST_TICKS
    assert set(delays[delays.index(1) :]) <= {1, -1}


def test_a_link_slower_than_any_stable_loop_gives_no_positions_until_it_recovers():
    link = Link()
    link.run(200, 1)
    delays = link.run(200, 6)
    assert set(delays[40:]) == {-1}
    assert set(link.run(200, 2)[-20:]) == {2}


@pytest.mark.slow
@pytest.mark.parametrize(
    "delay", [pytest.param(1, marks=pytest.mark.nightly), 2, pytest.param(3, marks=pytest.mark.nightly)]
)
@pytest.mark.parametrize(("lost", "twice"), [(0.02, 0.0), (0.1, 0.0), (0.0, 0.05), (0.03, 0.03)])
def test_lost_and_doubled_replies_are_distinguished_from_late_ones(delay, lost, twice):
    link = Link(lost, twice)
    delays = np.array(link.run(4000, delay)[100:])
    fresh = delays[delays > 0]
    assert len(fresh) > 3900 * (1.0 - 1.2 * lost - 1.2 * delay / RETEST_TICKS)
    assert (fresh == delay).mean() > 0.9
    assert (fresh >= delay).mean() > 0.95


@pytest.mark.slow
@pytest.mark.parametrize(("delay_s", "ticks"), [(0.0, 1), (1e-3, 2), (2e-3, 3), (3e-3, 4)])
def test_a_falcon_whose_replies_come_late_is_believed_to_be_late(delay_s, ticks):
    with EmulatedFalcon(emulator=Emulator(running=True, tremor_m=0.0)) as device:
        assert device.dynamics.delay_ticks(1000.0) == 1
        servo = Servo(device, clock=VirtualClock())
        reader = servo.telemetry.reader()
        servo.advance(300)
        assert set(reader.read().delay_ticks) == {1}
        device.hand.faults.set_durations(delay_s=delay_s)
        device.hand.faults.chance("delay", 1.0 if delay_s else 0.0)
        servo.advance(100)
        believed = reader.read().delay_ticks
        assert believed[50:].tolist() == [ticks] * 50
        assert device.describe()["delay_ticks"] == ticks
        servo.stop()


def test_a_falcon_that_is_late_when_opened_is_reported():
    emulator = Emulator(running=True, tremor_m=0.0)
    emulator.faults.set_durations(delay_s=1.5e-3)
    emulator.faults.chance("delay", 1.0)
    with EmulatedFalcon(emulator=emulator) as device:
        described = device.describe()
        assert 1.5e-3 < device.dynamics.delay_s < 2e-3
        assert described["dynamics"]["delay_s"] == device.dynamics.delay_s
        assert device.dynamics.delay_ticks(1000.0) == 2
        assert 40e-6 < device.dynamics.count_m < 60e-6
