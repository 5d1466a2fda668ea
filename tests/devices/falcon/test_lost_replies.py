"""Lost, late and failed packets in the exchange with a Falcon."""

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

if numba.config.DISABLE_JIT:
    pytest.skip("the exchange is made of C functions", allow_module_level=True)

from study_app.devices.falcon.exchange import COUNTERS
from study_app.devices.falcon.wire.constants import ERROR_IO, ERROR_NO_DEVICE, ERROR_OVERFLOW, ERROR_TIMEOUT
from study_app.devices.falcon.wire.replies import MOST_OWED
from study_app.haptics.kernels.c_functions import READ_LOST, READ_NEW, READ_NOTHING_NEW
from study_app.haptics.model.device_dynamics import MOST_DELAY
from tests.devices.falcon.support.scripted_bridge import CENTRE_M, GROWTH_N, PUSH_N, SOMEWHERE_M, Turns, force_of, reply


@pytest.fixture
def turns():
    return Turns()


class TestLostAndLate:
    def test_an_unplugged_bridge_is_lost_for_good(self, turns):
        turns.turn()
        turns.bridge.queue.append(ERROR_NO_DEVICE)
        assert turns.turn() == (READ_LOST, READ_LOST)
        sent = len(turns.bridge.sent)
        assert turns.turn(reply()) == (READ_LOST, READ_LOST)
        assert len(turns.bridge.sent) == sent

    def test_a_bridge_that_is_gone_when_written_to_is_lost(self, turns):
        turns.turn()
        turns.bridge.write_answer = ERROR_NO_DEVICE
        assert turns.turn(reply()) == (READ_NEW, READ_LOST)
        assert turns.turn(reply())[0] == READ_LOST

    @pytest.mark.parametrize("code", [ERROR_IO, ERROR_OVERFLOW])
    def test_other_errors_are_counted_and_lived_with(self, turns, code):
        turns.turn()
        turns.bridge.queue.append(code)
        turns.bridge.write_answer = code
        assert turns.turn() == (READ_NOTHING_NEW, 0)
        turns.bridge.write_answer = 0
        turns.turn()
        assert turns.turn(reply())[0] == READ_NEW
        assert (turns.falcon.read_errors, turns.falcon.write_errors) == (1, 1)

    def test_a_time_out_on_the_way_out_is_no_request(self, turns):
        turns.bridge.write_answer = ERROR_TIMEOUT
        turns.turn()
        assert (turns.falcon.requests, turns.falcon.write_errors) == (0, 1)

    def test_a_force_that_did_not_go_out_is_no_force_the_motors_push_with(self, turns):
        turns.open_gate()
        turns.turn(reply(), force_n=(0.3, 0.0, 0.0))
        held = turns.falcon.units.tolist()
        turns.bridge.write_answer = ERROR_TIMEOUT
        for _ in range(20):
            turns.turn(reply(), force_n=(5.0, 0.0, 0.0))
            assert turns.falcon.units.tolist() == held
        turns.bridge.write_answer = 0
        turns.turn(reply(), force_n=(5.0, 0.0, 0.0))
        assert np.linalg.norm(force_of(turns, CENTRE_M)) < 0.3 + GROWTH_N + 0.01

    def test_an_end_of_force_is_tried_again_until_it_goes_out(self, turns):
        turns.open_gate()
        turns.turn(reply(), force_n=PUSH_N)
        turns.bridge.write_answer = ERROR_TIMEOUT
        turns.turn(reply())
        assert turns.torques != [0, 0, 0]
        turns.bridge.write_answer = 0
        turns.turn(reply())
        assert turns.torques == [0, 0, 0]

    @pytest.mark.parametrize("force_n", [PUSH_N, (0.0, 0.0, 0.0)])
    def test_losses_are_written_off_after_a_short_test(self, turns, force_n):
        turns.open_gate()
        answers = []
        waiting = 1
        for turn in range(200):
            lost = turn % 20 == 0
            got = [reply()] * (waiting if not lost else 0)
            before = len(turns.bridge.sent)
            answers.append(turns.turn(*got, force_n=force_n)[0])
            waiting = len(turns.bridge.sent) - before
        silent = [answer != READ_NEW for answer in answers]
        longest = max(len(run) for run in "".join("x" if s else " " for s in silent).split())
        assert longest <= 4  # below the 5 ms after which the force would fade
        assert turns.falcon.written_off >= 10 - MOST_OWED - 1
        assert turns.falcon.owed <= MOST_OWED

    def test_replies_that_are_always_late_are_not_given(self, turns):
        turns.open_gate()
        pipe = [0] * 10  # how many replies come in so many turns
        fresh = []
        for _ in range(300):
            before = len(turns.bridge.sent)
            got = [reply(SOMEWHERE_M)] * pipe.pop(0)
            fresh.append(turns.turn(*got, force_n=PUSH_N)[0] == READ_NEW)
            pipe.append(len(turns.bridge.sent) - before)
        assert sum(fresh[10:]) == 0
        for _ in range(60):  # and when the pipe is quick again, it recovers
            pipe[:] = [sum(pipe)]
            before = len(turns.bridge.sent)
            fresh.append(turns.turn(*[reply(SOMEWHERE_M)] * pipe.pop(0), force_n=PUSH_N)[0] == READ_NEW)
            pipe.append(len(turns.bridge.sent) - before)
        assert all(fresh[-20:])

    @pytest.mark.parametrize("force_n", [(0.0, 0.0, 0.0), (0.5, -0.25, 1.0)])
    def test_a_measurement_of_the_delay_holds_no_great_change_of_force_back(self, turns, force_n):
        turns.open_gate()
        for _ in range(20):
            turns.turn(reply(), force_n=PUSH_N)
        turns.falcon.unsure = 1
        before = len(turns.bridge.sent)
        turns.turn(reply(), force_n=force_n)
        assert len(turns.bridge.sent) == before + 1
        assert turns.falcon.testing == 0
        for _ in range(MOST_DELAY):
            turns.turn(reply(), force_n=force_n)
        assert len(turns.bridge.sent) == before + MOST_DELAY, "but some turns later it is measured"
        assert turns.command[0].sent_n == pytest.approx(force_n, abs=5e-3)

    def test_a_force_is_withheld_for_two_turns_at_most_and_seldom_whatever_is_lost(self, turns):
        turns.open_gate()
        withheld = ""
        for turn in range(600):
            before = len(turns.bridge.sent)
            turns.turn(*[reply()] * (turn % 3 > 0), force_n=PUSH_N)
            withheld += " x"[len(turns.bridge.sent) == before]
        assert 5 < withheld.count("x") < 60
        assert max(map(len, withheld.split())) <= 2

    @settings(max_examples=60)
    @given(
        st.lists(
            st.sampled_from(["good", "good", "good", "lost", "cut", "twice", "io", "unhomed", "away", "garbage"]),
            max_size=120,
        )
    )
    def test_every_turn_and_every_packet_is_accounted_for(self, events):
        turns = Turns()
        turns.open_gate()
        for event in events:
            if event == "io":
                turns.bridge.queue.append(ERROR_IO)
            got = {
                "good": [reply()],
                "cut": [reply()[:14]],
                "twice": [reply(), reply()],
                "unhomed": [reply(homed=0)],
                "away": [reply(counts=(4000, -4000, 4000))],
                "garbage": [b"<AAAA>" * 5],
            }.get(event, [])
            turns.turn(*got, force_n=PUSH_N)
        count = {name: int(turns.falcon[name]) for name in COUNTERS}
        assert count["turns"] == count["fresh"] + count["missing"] + count["late"] + count["refused"]
        owed = int(turns.falcon.owed + turns.falcon.asked)
        assert count["requests"] - count["replies"] == owed + count["written_off"] - count["surplus"]
