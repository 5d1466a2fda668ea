"""Lost, late and failed packets in the exchange with a Falcon."""

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

if numba.config.DISABLE_JIT:
    pytest.skip("the exchange is made of C functions", allow_module_level=True)

from study_app.devices.falcon.constants import ERROR_IO, ERROR_NO_DEVICE, ERROR_OVERFLOW, ERROR_TIMEOUT
from study_app.devices.falcon.exchange import COUNTERS
from study_app.devices.falcon.replies import MOST_OWED
from study_app.haptics.kernels.c_functions import READ_LOST, READ_NEW, READ_NOTHING_NEW
from study_app.haptics.model.device_dynamics import MOST_DELAY
from tests.devices.falcon.support.scripted_bridge import CENTRE_M, GROWTH_N, PUSH_N, SOMEWHERE_M, Ticks, force_of, reply


@pytest.fixture
def ticks():
    return Ticks()


class TestLostAndLate:
    def test_an_unplugged_bridge_is_lost_for_good(self, ticks):
        ticks.tick()
        ticks.bridge.queue.append(ERROR_NO_DEVICE)
        assert ticks.tick() == (READ_LOST, READ_LOST)
        sent = len(ticks.bridge.sent)
        assert ticks.tick(reply()) == (READ_LOST, READ_LOST)
        assert len(ticks.bridge.sent) == sent

    def test_a_bridge_that_is_gone_when_written_to_is_lost(self, ticks):
        ticks.tick()
        ticks.bridge.write_answer = ERROR_NO_DEVICE
        assert ticks.tick(reply()) == (READ_NEW, READ_LOST)
        assert ticks.tick(reply())[0] == READ_LOST

    @pytest.mark.parametrize("code", [ERROR_IO, ERROR_OVERFLOW])
    def test_other_errors_are_counted_and_lived_with(self, ticks, code):
        ticks.tick()
        ticks.bridge.queue.append(code)
        ticks.bridge.write_answer = code
        assert ticks.tick() == (READ_NOTHING_NEW, 0)
        ticks.bridge.write_answer = 0
        ticks.tick()
        assert ticks.tick(reply())[0] == READ_NEW
        assert (ticks.falcon.read_errors, ticks.falcon.write_errors) == (1, 1)

    def test_a_time_out_on_the_way_out_is_no_request(self, ticks):
        ticks.bridge.write_answer = ERROR_TIMEOUT
        ticks.tick()
        assert (ticks.falcon.requests, ticks.falcon.write_errors) == (0, 1)

    def test_a_force_that_did_not_go_out_is_no_force_the_motors_push_with(self, ticks):
        ticks.open_gate()
        ticks.tick(reply(), force_n=(0.3, 0.0, 0.0))
        held = ticks.falcon.units.tolist()
        ticks.bridge.write_answer = ERROR_TIMEOUT
        for _ in range(20):
            ticks.tick(reply(), force_n=(5.0, 0.0, 0.0))
            assert ticks.falcon.units.tolist() == held
        ticks.bridge.write_answer = 0
        ticks.tick(reply(), force_n=(5.0, 0.0, 0.0))
        assert np.linalg.norm(force_of(ticks, CENTRE_M)) < 0.3 + GROWTH_N + 0.01

    def test_an_end_of_force_is_tried_again_until_it_goes_out(self, ticks):
        ticks.open_gate()
        ticks.tick(reply(), force_n=PUSH_N)
        ticks.bridge.write_answer = ERROR_TIMEOUT
        ticks.tick(reply())
        assert ticks.torques != [0, 0, 0]
        ticks.bridge.write_answer = 0
        ticks.tick(reply())
        assert ticks.torques == [0, 0, 0]

    @pytest.mark.parametrize("force_n", [PUSH_N, (0.0, 0.0, 0.0)])
    def test_losses_are_written_off_after_a_short_test(self, ticks, force_n):
        ticks.open_gate()
        answers = []
        waiting = 1
        for tick in range(200):
            lost = tick % 20 == 0
            got = [reply()] * (waiting if not lost else 0)
            before = len(ticks.bridge.sent)
            answers.append(ticks.tick(*got, force_n=force_n)[0])
            waiting = len(ticks.bridge.sent) - before
        silent = [answer != READ_NEW for answer in answers]
        longest = max(len(run) for run in "".join("x" if s else " " for s in silent).split())
        assert longest <= 4  # below the 5 ms after which the force would fade
        assert ticks.falcon.written_off >= 10 - MOST_OWED - 1
        assert ticks.falcon.owed <= MOST_OWED

    def test_replies_that_are_always_late_are_not_given(self, ticks):
        ticks.open_gate()
        pipe = [0] * 10  # how many replies come in so many ticks
        fresh = []
        for _ in range(300):
            before = len(ticks.bridge.sent)
            got = [reply(SOMEWHERE_M)] * pipe.pop(0)
            fresh.append(ticks.tick(*got, force_n=PUSH_N)[0] == READ_NEW)
            pipe.append(len(ticks.bridge.sent) - before)
        assert sum(fresh[10:]) == 0
        for _ in range(60):  # and when the pipe is quick again, it recovers
            pipe[:] = [sum(pipe)]
            before = len(ticks.bridge.sent)
            fresh.append(ticks.tick(*[reply(SOMEWHERE_M)] * pipe.pop(0), force_n=PUSH_N)[0] == READ_NEW)
            pipe.append(len(ticks.bridge.sent) - before)
        assert all(fresh[-20:])

    @pytest.mark.parametrize("force_n", [(0.0, 0.0, 0.0), (0.5, -0.25, 1.0)])
    def test_a_measurement_of_the_delay_holds_no_great_change_of_force_back(self, ticks, force_n):
        ticks.open_gate()
        for _ in range(20):
            ticks.tick(reply(), force_n=PUSH_N)
        ticks.falcon.unsure = 1
        before = len(ticks.bridge.sent)
        ticks.tick(reply(), force_n=force_n)
        assert len(ticks.bridge.sent) == before + 1
        assert ticks.falcon.testing == 0
        for _ in range(MOST_DELAY):
            ticks.tick(reply(), force_n=force_n)
        assert len(ticks.bridge.sent) == before + MOST_DELAY, "but some ticks later it is measured"
        assert ticks.command[0].sent_n == pytest.approx(force_n, abs=5e-3)

    def test_a_force_is_withheld_for_two_ticks_at_most_and_seldom_whatever_is_lost(self, ticks):
        ticks.open_gate()
        withheld = ""
        for tick in range(600):
            before = len(ticks.bridge.sent)
            ticks.tick(*[reply()] * (tick % 3 > 0), force_n=PUSH_N)
            withheld += " x"[len(ticks.bridge.sent) == before]
        assert 5 < withheld.count("x") < 60
        assert max(map(len, withheld.split())) <= 2

    @pytest.mark.nightly
    @pytest.mark.slow
    @settings(max_examples=60)
    @given(
        st.lists(
            st.sampled_from(["good", "good", "good", "lost", "cut", "twice", "io", "unhomed", "away", "garbage"]),
            max_size=120,
        )
    )
    def test_every_tick_and_every_packet_is_accounted_for(self, events):
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
