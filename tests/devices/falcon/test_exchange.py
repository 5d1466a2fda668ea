import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

if numba.config.DISABLE_JIT:
    pytest.skip("the exchange is made of C functions", allow_module_level=True)

from study_app.devices.falcon.exchange import COUNTERS, RAMP_S
from study_app.devices.falcon.kinematics import REACHED, inverse
from study_app.devices.falcon.packets import FLAGS_AT
from study_app.devices.falcon.replies import MOST_OWED
from study_app.devices.falcon.wire import (
    ERROR_IO,
    ERROR_NO_DEVICE,
    ERROR_OVERFLOW,
    ERROR_TIMEOUT,
    FLAG_BLUE,
    FLAG_GREEN,
    FLAG_HOMING,
    FLAG_RED,
    MOST_TORQUE,
    ZERO,
    quiet_packet,
)
from study_app.haptics.cfunctions import READ_LOST, READ_NEW, READ_NOTHING_NEW
from tests.devices.falcon.turns import (
    CENTRE_M,
    GEOMETRY,
    MODEM_STATUS,
    MS,
    OUT_M,
    UNITS_PER_NM,
    Turns,
    counts_at,
    reply,
)

PUSH_N = (1.0, -0.5, 2.0)
SOMEWHERE_M = (0.02, -0.01, 0.015)


@pytest.fixture
def turns():
    return Turns()


def force_of(turns, place_m):
    """Return the force that the last torques make at a place, by virtual work and differences."""
    mechanism = turns.falcon.mechanism

    def theta_at(place):
        theta = np.zeros(3)
        assert inverse(mechanism, np.add(place, [0, 0, GEOMETRY.centre_m]), theta) == REACHED
        return theta

    torque_nm = -np.array(turns.torques) / UNITS_PER_NM
    return np.array(
        [
            torque_nm @ (theta_at(np.add(place_m, step)) - theta_at(np.subtract(place_m, step))) / 2e-6
            for step in np.eye(3) * 1e-6
        ]
    )


class TestAPosition:
    def test_the_first_turn_asks_and_the_next_one_knows(self, turns):
        assert turns.turn() == (READ_NOTHING_NEW, 0)
        assert turns.bridge.sent == [quiet_packet(FLAG_HOMING | FLAG_RED)]
        assert turns.turn(reply(SOMEWHERE_M))[0] == READ_NEW
        assert turns.position_m == pytest.approx(SOMEWHERE_M, abs=60e-6)  # whole counts of the encoders

    def test_a_turn_without_a_reply_gives_nothing_new(self, turns):
        turns.turn()
        turns.turn(reply(SOMEWHERE_M))
        assert turns.turn()[0] == READ_NOTHING_NEW
        assert (turns.falcon.missing, turns.falcon.fresh) == (2, 1)

    def test_of_several_replies_the_newest_counts(self, turns):
        turns.turn()
        assert turns.turn(reply(CENTRE_M), reply(SOMEWHERE_M))[0] == READ_NEW
        assert turns.position_m == pytest.approx(SOMEWHERE_M, abs=60e-6)
        assert (turns.falcon.replies, turns.falcon.surplus) == (2, 1)

    def test_a_reply_that_comes_in_two_parts_is_one(self, turns):
        turns.turn()
        whole = reply(SOMEWHERE_M)
        turns.bridge.queue.append(MODEM_STATUS + whole[:9])
        assert turns.turn(whole[9:])[0] == READ_NEW
        assert turns.position_m == pytest.approx(SOMEWHERE_M, abs=60e-6)
        assert turns.falcon.cut_short == 1

    def test_a_reply_of_14_bytes_is_no_reply(self, turns):
        turns.turn()
        assert turns.turn(reply(SOMEWHERE_M)[:14])[0] == READ_NOTHING_NEW
        assert turns.turn(reply(SOMEWHERE_M))[0] == READ_NEW
        assert turns.falcon.parser.skipped == 14
        assert turns.falcon.replies == 1

    def test_status_bytes_alone_are_asked_after_once_more(self, turns):
        turns.turn()
        turns.bridge.queue.append(MODEM_STATUS)
        assert turns.turn(reply(SOMEWHERE_M))[0] == READ_NEW

    def test_a_reply_from_before_a_pause_is_not_given(self, turns):
        turns.turn()
        turns.turn(reply(CENTRE_M))
        assert turns.turn(reply(SOMEWHERE_M), after_ns=30 * MS)[0] == READ_NOTHING_NEW
        assert turns.turn(reply(SOMEWHERE_M))[0] == READ_NEW

    def test_encoders_of_no_pose_are_refused(self, turns):
        turns.turn()
        turns.turn(reply(SOMEWHERE_M))
        before = turns.position_m
        assert turns.turn(reply(counts=(4000, -4000, 4000)))[0] == READ_NOTHING_NEW
        assert turns.falcon.refused == 1
        assert (turns.position_m == before).all()

    def test_a_garbled_encoder_is_not_believed(self, turns):
        turns.turn()
        turns.turn(reply(SOMEWHERE_M))
        before = turns.position_m
        counts = counts_at(SOMEWHERE_M)
        assert turns.turn(reply(counts=np.add(counts, [0, 0x40, 0])))[0] == READ_NOTHING_NEW
        assert turns.turn(reply(counts=np.add(counts, [1, 0, 0])))[0] == READ_NEW
        assert turns.position_m == pytest.approx(before, abs=1e-4)
        assert turns.falcon.refused == 1

    def test_a_leap_that_a_second_reply_confirms_is_believed(self, turns):
        turns.turn()
        turns.turn(reply(CENTRE_M))
        assert turns.turn(reply(SOMEWHERE_M))[0] == READ_NOTHING_NEW
        assert turns.turn(reply(SOMEWHERE_M))[0] == READ_NEW
        assert turns.position_m == pytest.approx(SOMEWHERE_M, abs=60e-6)

    def test_encoders_that_leap_on_and_on_are_believed_in_the_end(self, turns):
        turns.turn()
        turns.turn(reply(CENTRE_M))
        counts = counts_at(CENTRE_M)
        answers = [turns.turn(reply(counts=counts + k * 100))[0] for k in range(1, 10)]
        assert answers[:3] == [READ_NOTHING_NEW, READ_NOTHING_NEW, READ_NEW]

    @pytest.mark.parametrize("speed_mps", [0.5, 2.0])
    def test_a_swift_hand_is_believed_though_replies_are_lost(self, turns, speed_mps):
        turns.turn()
        x, v = -0.035, 0.0
        for turn in range(1000):
            turns.turn(*[] if turn % 7 == 3 else [reply((x, 0.0, 0.0))] * turns.falcon.asked)
            v = min(v + 0.1, speed_mps)  # 10 g
            x += v / 1000
            if x > 0.035:
                break
        assert turns.falcon.refused == 0

    def test_a_button_is_down_when_two_packets_say_so(self, turns):
        turns.turn()
        turns.turn(reply())
        turns.turn(reply(buttons=0b1000))
        assert turns.reading[0].buttons == 0
        turns.turn(reply(buttons=0b1000))
        assert turns.reading[0].buttons == 0b1000


class TestTheGate:
    def test_no_force_before_homed_nor_before_the_out_stroke(self, turns):
        turns.turn(force_n=PUSH_N)
        for homed in (0b000, 0b011, 0b110, 0b101):
            for _ in range(20):
                assert turns.turn(reply(OUT_M, homed=homed), force_n=PUSH_N)[0] == READ_NOTHING_NEW
                assert turns.torques == [0, 0, 0]
        for _ in range(50):
            assert turns.turn(reply(), force_n=PUSH_N)[0] == READ_NEW
            assert turns.torques == [0, 0, 0]

    def test_the_force_comes_in_over_half_a_second(self, turns):
        turns.turn()
        turns.pull_out()
        shares = []
        for _ in range(round(RAMP_S * 1000) + 10):
            turns.turn(reply(), force_n=PUSH_N)
            shares.append(np.linalg.norm(force_of(turns, CENTRE_M)) / np.linalg.norm(PUSH_N))
        steps = np.diff(shares)
        assert steps.max() < 0.01
        assert shares[249] == pytest.approx(0.5, abs=0.02)
        assert shares[-1] == pytest.approx(1.0, abs=0.01)

    def test_what_passes_is_the_force_that_was_asked_for(self, turns):
        turns.open_gate()
        for _ in range(10):
            turns.turn(reply(SOMEWHERE_M), force_n=PUSH_N)
        assert force_of(turns, turns.position_m) == pytest.approx(PUSH_N, abs=0.005)

    def test_homed_bits_that_are_gone_close_it_until_the_next_out_stroke(self, turns):
        turns.open_gate()
        for _ in range(3):
            assert turns.turn(reply(homed=0b110), force_n=PUSH_N)[0] == READ_NOTHING_NEW
        assert turns.torques == [0, 0, 0]
        for _ in range(20):
            turns.turn(reply(), force_n=PUSH_N)
            assert turns.torques == [0, 0, 0]
        turns.pull_out()
        turns.turn(reply(), force_n=PUSH_N)
        turns.turn(reply(), force_n=PUSH_N)
        assert turns.torques != [0, 0, 0]

    def test_one_garbled_packet_does_not_open_it(self, turns):
        turns.turn()
        for _ in range(5):
            turns.turn(reply(OUT_M, homed=0b011), force_n=PUSH_N)
        turns.turn(reply(OUT_M, homed=0b111), force_n=PUSH_N)
        turns.turn(reply(OUT_M, homed=0b011), force_n=PUSH_N)
        assert (turns.falcon.pulled_out, turns.falcon.share) == (0, 0.0)
        turns.turn(reply(OUT_M, homed=0b111), force_n=PUSH_N)
        assert (turns.falcon.pulled_out, turns.torques) == (0, [0, 0, 0])
        turns.turn(reply(OUT_M, homed=0b111), force_n=PUSH_N)
        assert turns.falcon.pulled_out == 1

    def test_one_garbled_packet_does_not_close_it(self, turns):
        turns.open_gate()
        assert turns.turn(reply(homed=0b011), force_n=PUSH_N)[0] == READ_NOTHING_NEW
        assert turns.turn(reply(), force_n=PUSH_N)[0] == READ_NEW
        assert turns.falcon.share == 1.0
        assert turns.torques != [0, 0, 0]

    def test_the_force_steps_by_less_than_half_a_newton_whatever_is_asked_for(self, turns):
        turns.open_gate()
        before = np.zeros(3)
        for turn in range(60):
            turns.turn(reply(), force_n=(5.0, 0.0, 0.0) if turn < 30 else (-5.0, 1.0, 3.0))
            given = force_of(turns, CENTRE_M)
            assert np.linalg.norm(given - before) < 0.48
            before = given
        assert given == pytest.approx([-5.0, 1.0, 3.0], abs=0.01)
        turns.turn(reply())  # but no force is no force at once
        assert turns.torques == [0, 0, 0]

    def test_more_than_the_motors_give_keeps_its_direction(self, turns):
        turns.open_gate()
        for _ in range(100):
            turns.turn(reply(), force_n=tuple(20 * np.array(PUSH_N)))
        assert max(map(abs, turns.torques)) == MOST_TORQUE
        given = force_of(turns, CENTRE_M)
        assert given / np.linalg.norm(given) == pytest.approx(PUSH_N / np.linalg.norm(PUSH_N), abs=2e-3)
        assert turns.falcon.shortened > 50

    @pytest.mark.parametrize("bad", [np.nan, np.inf])
    def test_a_force_that_is_no_number_is_none(self, turns, bad):
        turns.open_gate()
        turns.turn(reply(), force_n=(1.0, bad, 0.0))
        assert turns.torques == [0, 0, 0]

    def test_every_packet_holds_the_homing_flag_and_the_light_of_the_gate(self, turns):
        def flags_after(*got):
            turns.turn(*got)
            return turns.bridge.sent[-1][FLAGS_AT] - ZERO

        turns.turn()
        assert flags_after(reply(homed=0b011)) == FLAG_HOMING | FLAG_RED
        assert flags_after(reply()) == FLAG_HOMING | FLAG_BLUE
        turns.pull_out()
        assert flags_after(reply()) == FLAG_HOMING | FLAG_GREEN
        for _ in range(3):
            flags = flags_after(reply(homed=0))
        assert flags == FLAG_HOMING | FLAG_RED


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
        assert np.linalg.norm(force_of(turns, CENTRE_M)) < 0.3 + 0.48

    def test_an_end_of_force_is_tried_again_until_it_goes_out(self, turns):
        turns.open_gate()
        while not turns.falcon.testing:
            turns.turn(*[reply()] * int(turns.now_ns // MS % 2), force_n=PUSH_N)
        turns.bridge.write_answer = ERROR_TIMEOUT
        turns.turn(reply())
        assert turns.torques != [0, 0, 0]
        turns.bridge.write_answer = 0
        turns.turn(reply())
        assert turns.falcon.testing
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

    def test_an_end_of_force_is_sent_whatever_is_being_tested(self, turns):
        turns.open_gate()
        while not turns.falcon.testing:
            turns.turn(*[reply()] * int(turns.now_ns // MS % 2), force_n=PUSH_N)
        assert turns.torques != [0, 0, 0]
        turns.turn()
        assert turns.torques == [0, 0, 0]

    def test_a_force_is_never_withheld_for_more_than_two_turns(self, turns):
        turns.open_gate()
        withheld = 0
        for _ in range(200):
            before = len(turns.bridge.sent)
            turns.turn(force_n=PUSH_N)
            withheld = withheld + 1 if len(turns.bridge.sent) == before else 0
            assert withheld <= 2

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
