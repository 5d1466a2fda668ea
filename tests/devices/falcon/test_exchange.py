"""The compiled exchange with a Falcon over a scripted bridge: each tick's answer, place, force and packet as a golden.

At every tick it is checked besides that the force that the command says is the one that the packet's torques make by
virtual work, that it exceeds no limit, and that it acts only while the gate is open.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

if numba.config.DISABLE_JIT:
    pytest.skip("the exchange is made of C functions", allow_module_level=True)

from study_app.devices.falcon.constants import ERROR_IO, ERROR_NO_DEVICE, ERROR_OVERFLOW, ERROR_TIMEOUT
from study_app.devices.falcon.exchange import COUNTERS, limit_growth, set_motor_units
from study_app.devices.falcon.mechanics import GEOMETRIES, REACHED, SAFE_BOX_M, inverse, new_mechanism
from study_app.haptics.kernels.c_functions import READ_LOST, READ_NEW, READ_NOTHING_NEW
from tests.devices.falcon.support.scripted_bridge import (
    CENTRE_M,
    GROWTH_N,
    MODEM_STATUS,
    MS,
    OUT_M,
    PUSH_N,
    SOMEWHERE_M,
    UNITS_PER_NM,
    Ticks,
    counts_at,
    force_of,
    reply,
)
from tests.golden import compare, runs

ANSWERS = {READ_NEW: "new", READ_NOTHING_NEW: "nothing", READ_LOST: "lost"}
GREAT_N = tuple(20 * np.array(PUSH_N))


class Recorded(Ticks):
    """Ticks that record one in ``every`` as a line."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[str] = []
        self.every, self.tick_count = 1, 0
        self.falcon.force_limit_n = 8.0

    def tick(self, *replies: bytes, **how: Any) -> tuple[int, int]:
        falcon, sent = self.falcon, len(self.bridge.sent)
        answers = super().tick(*replies, **how)
        went = self.bridge.sent[sent:]
        sent_n = self.command[0].sent_n.copy()
        size_n = float(np.linalg.norm(sent_n))
        if went and answers[0] == READ_NEW:
            assert force_of(self, self.position_m) == pytest.approx(sent_n, abs=0.01)
        if went and not falcon.share:
            assert self.torques == [0, 0, 0]
        assert size_n <= 8.0 * 1.001 or falcon.force_limit_n > 8.0
        self.tick_count += 1
        if self.tick_count % self.every == 0:
            flags = [f"{int(packet[13] - 0x41):04b}" for packet in went]
            vectors = np.round([1e3 * self.position_m, sent_n], 2) + 0.0
            recorded = [" ".join(f"{value:.2f}" for value in vector) for vector in vectors]
            answer = " ".join(ANSWERS[code] for code in answers)
            self.lines.append(f"{answer} | {' | '.join(recorded)} | {self.reading[0].buttons} | {' '.join(flags)}")
        return answers

    def ticks(self, count: int, *replies: bytes, **how: Any) -> None:
        for _ in range(count):
            self.tick(*replies, **how)


def positions(recorded: Recorded) -> None:
    recorded.tick()
    recorded.tick(reply(SOMEWHERE_M))
    recorded.tick()
    recorded.bridge.queue.append(MODEM_STATUS + reply(CENTRE_M) + reply(SOMEWHERE_M))  # two
    recorded.tick()
    recorded.bridge.queue.extend(MODEM_STATUS + part for part in (reply(SOMEWHERE_M)[:9], reply(SOMEWHERE_M)[9:]))
    recorded.tick()
    recorded.tick(reply()[:14])
    recorded.tick(reply(SOMEWHERE_M))
    recorded.bridge.queue.extend([MODEM_STATUS, MODEM_STATUS + reply(SOMEWHERE_M)])
    recorded.tick()
    recorded.tick(reply(), after_ns=30 * MS)  # from before a pause
    recorded.tick(reply())


def places_that_cannot_be(recorded: Recorded) -> None:
    recorded.tick()
    recorded.tick(reply(SOMEWHERE_M))
    recorded.tick(reply(counts=(4000, -4000, 4000)))  # no pose
    counts = counts_at(SOMEWHERE_M)
    recorded.tick(reply(counts=np.add(counts, [0, 0x40, 0])))  # garbled
    recorded.tick(reply(counts=np.add(counts, [1, 0, 0])))
    recorded.ticks(2, reply(CENTRE_M))  # a leap that a second reply confirms
    for k in range(1, 10):
        recorded.tick(reply(counts=counts_at(CENTRE_M) + k * 100))


def buttons(recorded: Recorded) -> None:
    recorded.tick()
    recorded.tick(reply())
    recorded.ticks(2, reply(buttons=0b1000))


def gate(recorded: Recorded) -> None:
    recorded.tick(force_n=PUSH_N)
    for homed in (0b000, 0b011, 0b110, 0b101):
        recorded.ticks(3, reply(OUT_M, homed=homed), force_n=PUSH_N)
    recorded.ticks(20, reply(), force_n=PUSH_N)
    recorded.ticks(3, reply(OUT_M, homed=0b011), force_n=PUSH_N)
    recorded.tick(reply(OUT_M), force_n=PUSH_N)  # one garbled packet does not open it
    recorded.tick(reply(OUT_M, homed=0b011), force_n=PUSH_N)
    recorded.ticks(2, reply(OUT_M), force_n=PUSH_N)
    recorded.ticks(3, reply(), force_n=PUSH_N)
    recorded.every = 50
    recorded.ticks(560, reply(), force_n=PUSH_N)  # it comes in over half a second
    recorded.every = 1
    recorded.tick(reply(homed=0b011), force_n=PUSH_N)  # one does not close it
    recorded.tick(reply(), force_n=PUSH_N)
    recorded.ticks(3, reply(homed=0b110), force_n=PUSH_N)
    recorded.ticks(5, reply(), force_n=PUSH_N)
    recorded.pull_out()
    recorded.ticks(3, reply(), force_n=PUSH_N)


def growth(recorded: Recorded) -> None:
    recorded.open_gate()
    recorded.lines.clear()
    recorded.ticks(12, reply(), force_n=(5.0, 0.0, 0.0))
    recorded.ticks(3, reply(), force_n=(-5.0, 0.0, 0.0))  # falls at once and grows by steps
    recorded.ticks(2, reply(), force_n=(-1.0, 0.0, 0.0))
    recorded.tick(reply())
    for bad in (np.nan, np.inf, 8.1):
        recorded.ticks(2, reply(), force_n=(1.0, 2.0, 0.0))
        recorded.tick(reply(), force_n=(1.0, bad, 0.0))
    recorded.falcon.force_limit_n = np.inf
    recorded.every = 20
    recorded.ticks(100, reply(SOMEWHERE_M), force_n=GREAT_N)  # more than the motors give keeps its direction


def braking(recorded: Recorded) -> None:
    recorded.open_gate()
    for along in (1.0, -1.0):
        recorded.lines.clear()
        for place in np.arange(40) * 0.3e-3:  # 0.3 m/s
            recorded.tick(reply((along * place, 0.0, 0.0)), force_n=(0.0, 0.5, 0.0))
        recorded.tick(reply((along * 12e-3, 0.0, 0.0)), force_n=(4.0, 0.5, 0.0))
        assert abs(recorded.command[0].sent_n[0] - (GROWTH_N if along > 0 else 4.0)) < 0.05
        recorded.ticks(20, reply())


def errors(recorded: Recorded) -> None:
    recorded.tick()
    for code in (ERROR_IO, ERROR_OVERFLOW):
        recorded.bridge.queue.append(code)
        recorded.bridge.write_answer = code
        recorded.tick()
        recorded.bridge.write_answer = 0
        recorded.tick()
        recorded.tick(reply())
    recorded.bridge.write_answer = ERROR_TIMEOUT  # on the way out: no request
    recorded.tick()


def packets_that_do_not_go_out(recorded: Recorded) -> None:
    recorded.open_gate()
    recorded.lines.clear()
    recorded.tick(reply(), force_n=(0.3, 0.0, 0.0))
    recorded.bridge.write_answer = ERROR_TIMEOUT
    recorded.ticks(20, reply(), force_n=(5.0, 0.0, 0.0))
    recorded.tick(reply())  # nor does an end of force: it is tried again
    recorded.bridge.write_answer = 0
    recorded.tick(reply(), force_n=(5.0, 0.0, 0.0))
    assert np.linalg.norm(force_of(recorded, CENTRE_M)) < 0.3 + GROWTH_N + 0.01
    recorded.tick(reply())
    assert recorded.torques == [0, 0, 0]


def unplugged(recorded: Recorded) -> None:
    recorded.tick()
    recorded.bridge.queue.append(ERROR_NO_DEVICE)
    recorded.ticks(2)
    recorded.tick(reply())


def gone_when_written_to(recorded: Recorded) -> None:
    recorded.tick()
    recorded.bridge.write_answer = ERROR_NO_DEVICE
    recorded.ticks(2, reply())


def losses(recorded: Recorded) -> None:
    recorded.open_gate()
    recorded.lines.clear()
    waiting = 1
    for tick in range(120):
        before = len(recorded.bridge.sent)
        recorded.tick(*[reply()] * (waiting if tick % 20 else 0), force_n=PUSH_N)
        waiting = len(recorded.bridge.sent) - before
    runs = "".join(" " if line.startswith("new") else "x" for line in recorded.lines).split()
    assert max(map(len, runs)) <= 4  # below the 5 ms after which the force would fade


def late_replies(recorded: Recorded) -> None:
    recorded.open_gate()
    recorded.lines.clear()
    pipe = [0] * 10  # how many replies come in so many ticks
    for tick in range(200):
        if tick >= 140:  # when the pipe is quick again, it recovers
            pipe[:] = [sum(pipe)]
        before = len(recorded.bridge.sent)
        recorded.tick(*[reply(SOMEWHERE_M)] * pipe.pop(0), force_n=PUSH_N)
        pipe.append(len(recorded.bridge.sent) - before)
    assert not any(line.startswith("new") for line in recorded.lines[10:140])
    assert all(line.startswith("new") for line in recorded.lines[-20:])


def measurements_of_the_delay(recorded: Recorded) -> None:
    recorded.open_gate()
    for force_n in ((0.0, 0.0, 0.0), (0.5, -0.25, 1.0)):  # a great change of force is not held back by one
        recorded.ticks(20, reply(), force_n=PUSH_N)
        recorded.lines.clear()
        recorded.falcon.unsure = 1
        recorded.ticks(6, reply(), force_n=force_n)
    for tick in range(60):  # and is withheld for two ticks at most, seldom, whatever is lost
        recorded.tick(*[reply()] * (tick % 3 > 0), force_n=PUSH_N)
    withheld = "".join("x" if line.endswith("| ") else " " for line in recorded.lines).split()
    assert max(map(len, withheld)) <= 2


def swift_hands(recorded: Recorded) -> None:
    recorded.tick()
    for speed_mps in (0.5, 2.0):  # believed though replies are lost
        x, v = -0.035, 0.0
        recorded.ticks(3, reply((x, 0.0, 0.0)))
        recorded.lines.clear()
        refused = int(recorded.falcon.refused)
        while x < 0.035:
            recorded.tick(*[] if recorded.tick_count % 7 == 3 else [reply((x, 0.0, 0.0))] * recorded.falcon.asked)
            v = min(v + 0.1, speed_mps)  # 10 g
            x += v / 1000
        assert recorded.falcon.refused == refused


SCENARIOS = (
    positions, places_that_cannot_be, buttons, gate, growth, braking, errors, packets_that_do_not_go_out, unplugged,
    gone_when_written_to, losses, late_replies, measurements_of_the_delay, swift_hands,
)  # fmt: skip


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_the_exchange_answers_and_sends_as_recorded(
    scenario: Callable[[Recorded], None], pytestconfig: pytest.Config
) -> None:
    recorded = Recorded()
    scenario(recorded)
    recorded.lines.append(" ".join(f"{name} {recorded.falcon[name]}" for name in COUNTERS if recorded.falcon[name]))
    compare(Path(__file__).parent / "golden" / f"exchange_{scenario.__name__}.txt", runs(recorded.lines), pytestconfig)


@pytest.mark.slow
def test_limited_growth_never_makes_a_force_longer() -> None:
    falcon = Ticks().falcon
    random = np.random.default_rng(3)
    falcon.tick_s, falcon.slew_n_per_s = 1e-3, 1500.0
    shortened = 0
    for _ in range(5_000):
        asked_n = random.normal(0, 4, 3)
        falcon.force_n, falcon.held_n, falcon.velocity_mps = asked_n, random.normal(0, 4, 3), random.normal(0, 0.3, 3)
        limit_growth(falcon)
        assert np.linalg.norm(falcon.force_n) <= np.linalg.norm(asked_n) * (1 + 1e-12)
        shortened += np.linalg.norm(falcon.force_n - asked_n) > 1e-9
    assert shortened > 1_000


@pytest.mark.parametrize("geometry", GEOMETRIES.values(), ids=list(GEOMETRIES))
@given(
    position_m=st.tuples(*(st.floats(low, high) for low, high in SAFE_BOX_M)),
    direction=st.tuples(*[st.floats(-1, 1)] * 3),
)
@example(position_m=(SAFE_BOX_M[0][1], 0.0, SAFE_BOX_M[2][0]), direction=(1.0, 0.3, 0.2))
def test_rounding_to_motor_units_never_exceeds_the_force_limit(geometry, position_m, direction) -> None:
    length = np.linalg.norm(direction)
    assume(length > 0.1)
    falcon = Ticks().falcon
    falcon.mechanism = new_mechanism(geometry, units_per_nm=UNITS_PER_NM)
    falcon.position_m = position_m
    assume(inverse(falcon.mechanism, falcon.position_m, falcon.theta) == REACHED)
    falcon.homed, falcon.share, falcon.tick_s, falcon.slew_n_per_s = 1, 1.0, 1e-3, 1e6
    falcon.force_limit_n = 8.0
    falcon.force_n = 8.0 / length * np.array(direction)
    set_motor_units(falcon)
    assert np.linalg.norm(falcon.sent_n) <= 8.0 + 1e-9


EVENTS = ["good", "good", "good", "lost", "cut", "twice", "io", "unhomed", "away", "garbage"]


@pytest.mark.nightly
@pytest.mark.slow
@settings(max_examples=60)
@given(st.lists(st.sampled_from(EVENTS), max_size=120))
def test_every_tick_and_every_packet_is_accounted_for(events: list[str]) -> None:
    ticks = Ticks()
    ticks.open_gate()
    for event in events:
        if event == "io":
            ticks.bridge.queue.append(ERROR_IO)
        got = {
            "good": [reply()],
            "cut": [reply()[:14]],
            "twice": [reply(), reply()],
            "unhomed": [reply(homed=0)],
            "away": [reply(counts=(4000, -4000, 4000))],
            "garbage": [b"<AAAA>" * 5],
        }.get(event, [])
        ticks.tick(*got, force_n=PUSH_N)
    count = {name: int(ticks.falcon[name]) for name in COUNTERS}
    assert count["ticks"] == count["fresh"] + count["missing"] + count["late"] + count["refused"]
    owed = int(ticks.falcon.owed + ticks.falcon.asked)
    assert count["requests"] - count["replies"] == owed + count["written_off"] - count["surplus"]
