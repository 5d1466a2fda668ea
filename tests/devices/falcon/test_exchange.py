import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("the exchange is made of C functions", allow_module_level=True)

from study_app.devices.falcon.constants import (
    ERROR_TIMEOUT,
    FLAG_BLUE,
    FLAG_GREEN,
    FLAG_HOMING,
    FLAG_RED,
    MOST_TORQUE,
    ZERO,
    quiet_packet,
)
from study_app.devices.falcon.exchange import RAMP_S
from study_app.devices.falcon.replies import FLAGS_AT
from study_app.haptics.kernels.c_functions import READ_NEW, READ_NOTHING_NEW
from tests.devices.falcon.support.scripted_bridge import (
    CENTRE_M,
    GROWTH_N,
    MODEM_STATUS,
    MS,
    OUT_M,
    PUSH_N,
    SOMEWHERE_M,
    Ticks,
    counts_at,
    force_of,
    reply,
)


@pytest.fixture
def ticks():
    return Ticks()


class TestAPosition:
    def test_the_first_tick_asks_and_the_next_one_knows(self, ticks):
        assert ticks.tick() == (READ_NOTHING_NEW, 0)
        assert ticks.bridge.sent == [quiet_packet(FLAG_HOMING | FLAG_RED)]
        assert ticks.tick(reply(SOMEWHERE_M))[0] == READ_NEW
        assert ticks.position_m == pytest.approx(SOMEWHERE_M, abs=60e-6)  # whole counts of the encoders

    @pytest.mark.parametrize(
        ("came", "answers", "counted"),
        [
            ([[reply(SOMEWHERE_M)], []], [READ_NEW, READ_NOTHING_NEW], {"missing": 2, "fresh": 1}),
            ([[MODEM_STATUS + reply(CENTRE_M) + reply(SOMEWHERE_M)]], [READ_NEW], {"replies": 2, "surplus": 1}),
            ([[reply(SOMEWHERE_M)[:9], reply(SOMEWHERE_M)[9:]]], [READ_NEW], {"cut_short": 1}),
            ([[reply()[:14]], [reply(SOMEWHERE_M)]], [READ_NOTHING_NEW, READ_NEW], {"replies": 1}),
            ([[b"", reply(SOMEWHERE_M)]], [READ_NEW], {"replies": 1}),
        ],
        ids=["none", "two", "in two parts", "of 14 bytes", "after status bytes alone"],
    )
    def test_replies_are_new_positions_however_they_come(self, ticks, came, answers, counted):
        ticks.tick()
        for parts, answer in zip(came, answers, strict=True):
            ticks.bridge.queue.extend(part if part[:2] == MODEM_STATUS else MODEM_STATUS + part for part in parts)
            assert ticks.tick()[0] == answer
        assert ticks.position_m == pytest.approx(SOMEWHERE_M, abs=60e-6)
        assert {name: ticks.falcon[name] for name in counted} == counted

    def test_a_reply_from_before_a_pause_is_not_given(self, ticks):
        ticks.tick()
        ticks.tick(reply(CENTRE_M))
        assert ticks.tick(reply(SOMEWHERE_M), after_ns=30 * MS)[0] == READ_NOTHING_NEW
        assert ticks.tick(reply(SOMEWHERE_M))[0] == READ_NEW

    def test_encoders_of_no_pose_are_refused(self, ticks):
        ticks.tick()
        ticks.tick(reply(SOMEWHERE_M))
        before = ticks.position_m
        assert ticks.tick(reply(counts=(4000, -4000, 4000)))[0] == READ_NOTHING_NEW
        assert ticks.falcon.refused == 1
        assert (ticks.position_m == before).all()

    def test_a_garbled_encoder_is_not_believed(self, ticks):
        ticks.tick()
        ticks.tick(reply(SOMEWHERE_M))
        before = ticks.position_m
        counts = counts_at(SOMEWHERE_M)
        assert ticks.tick(reply(counts=np.add(counts, [0, 0x40, 0])))[0] == READ_NOTHING_NEW
        assert ticks.tick(reply(counts=np.add(counts, [1, 0, 0])))[0] == READ_NEW
        assert ticks.position_m == pytest.approx(before, abs=1e-4)
        assert ticks.falcon.refused == 1

    def test_a_leap_that_a_second_reply_confirms_is_believed(self, ticks):
        ticks.tick()
        ticks.tick(reply(CENTRE_M))
        assert ticks.tick(reply(SOMEWHERE_M))[0] == READ_NOTHING_NEW
        assert ticks.tick(reply(SOMEWHERE_M))[0] == READ_NEW
        assert ticks.position_m == pytest.approx(SOMEWHERE_M, abs=60e-6)

    def test_encoders_that_leap_on_and_on_are_believed_in_the_end(self, ticks):
        ticks.tick()
        ticks.tick(reply(CENTRE_M))
        counts = counts_at(CENTRE_M)
        answers = [ticks.tick(reply(counts=counts + k * 100))[0] for k in range(1, 10)]
        assert answers[:3] == [READ_NOTHING_NEW, READ_NOTHING_NEW, READ_NEW]

    @pytest.mark.parametrize("speed_mps", [0.5, 2.0])
    def test_a_swift_hand_is_believed_though_replies_are_lost(self, ticks, speed_mps):
        ticks.tick()
        x, v = -0.035, 0.0
        for tick in range(1000):
            ticks.tick(*[] if tick % 7 == 3 else [reply((x, 0.0, 0.0))] * ticks.falcon.asked)
            v = min(v + 0.1, speed_mps)  # 10 g
            x += v / 1000
            if x > 0.035:
                break
        assert ticks.falcon.refused == 0

    def test_a_button_is_down_when_two_packets_say_so(self, ticks):
        ticks.tick()
        ticks.tick(reply())
        ticks.tick(reply(buttons=0b1000))
        assert ticks.reading[0].buttons == 0
        ticks.tick(reply(buttons=0b1000))
        assert ticks.reading[0].buttons == 0b1000


class TestTheGate:
    def test_no_force_before_homed_nor_before_the_out_stroke(self, ticks):
        ticks.tick(force_n=PUSH_N)
        for homed in (0b000, 0b011, 0b110, 0b101):
            for _ in range(20):
                assert ticks.tick(reply(OUT_M, homed=homed), force_n=PUSH_N)[0] == READ_NOTHING_NEW
                assert ticks.torques == [0, 0, 0]
        for _ in range(50):
            assert ticks.tick(reply(), force_n=PUSH_N)[0] == READ_NEW
            assert ticks.torques == [0, 0, 0]

    def test_the_force_comes_in_over_half_a_second(self, ticks):
        ticks.tick()
        ticks.pull_out()
        shares = []
        for _ in range(round(RAMP_S * 1000) + 10):
            ticks.tick(reply(), force_n=PUSH_N)
            shares.append(np.linalg.norm(force_of(ticks, CENTRE_M)) / np.linalg.norm(PUSH_N))
        steps = np.diff(shares)
        assert steps.max() < 0.01
        assert shares[249] == pytest.approx(0.5, abs=0.02)
        assert shares[-1] == pytest.approx(1.0, abs=0.01)

    def test_what_passes_is_the_force_that_was_asked_for(self, ticks):
        ticks.open_gate()
        for _ in range(10):
            ticks.tick(reply(SOMEWHERE_M), force_n=PUSH_N)
        assert force_of(ticks, ticks.position_m) == pytest.approx(PUSH_N, abs=0.005)

    def test_homed_bits_that_are_gone_close_it_until_the_next_out_stroke(self, ticks):
        ticks.open_gate()
        for _ in range(3):
            assert ticks.tick(reply(homed=0b110), force_n=PUSH_N)[0] == READ_NOTHING_NEW
        assert ticks.torques == [0, 0, 0]
        for _ in range(20):
            ticks.tick(reply(), force_n=PUSH_N)
            assert ticks.torques == [0, 0, 0]
        ticks.pull_out()
        ticks.tick(reply(), force_n=PUSH_N)
        ticks.tick(reply(), force_n=PUSH_N)
        assert ticks.torques != [0, 0, 0]

    def test_one_garbled_packet_does_not_open_it(self, ticks):
        ticks.tick()
        for _ in range(5):
            ticks.tick(reply(OUT_M, homed=0b011), force_n=PUSH_N)
        ticks.tick(reply(OUT_M, homed=0b111), force_n=PUSH_N)
        ticks.tick(reply(OUT_M, homed=0b011), force_n=PUSH_N)
        assert (ticks.falcon.pulled_out, ticks.falcon.share) == (0, 0.0)
        ticks.tick(reply(OUT_M, homed=0b111), force_n=PUSH_N)
        assert (ticks.falcon.pulled_out, ticks.torques) == (0, [0, 0, 0])
        ticks.tick(reply(OUT_M, homed=0b111), force_n=PUSH_N)
        assert ticks.falcon.pulled_out == 1

    def test_one_garbled_packet_does_not_close_it(self, ticks):
        ticks.open_gate()
        assert ticks.tick(reply(homed=0b011), force_n=PUSH_N)[0] == READ_NOTHING_NEW
        assert ticks.tick(reply(), force_n=PUSH_N)[0] == READ_NEW
        assert ticks.falcon.share == 1.0
        assert ticks.torques != [0, 0, 0]

    def test_a_force_grows_by_no_more_than_the_servos_slew_limit_and_falls_at_once(self, ticks):
        ticks.open_gate()
        before = 0.0
        for _ in range(12):
            ticks.tick(reply(), force_n=(5.0, 0.0, 0.0))
            size = np.linalg.norm(force_of(ticks, CENTRE_M))
            assert size - before < GROWTH_N + 0.01
            before = size
        assert force_of(ticks, CENTRE_M) == pytest.approx([5.0, 0.0, 0.0], abs=0.01)
        ticks.tick(reply(), force_n=(1.0, 0.0, 0.0))
        assert force_of(ticks, CENTRE_M) == pytest.approx([1.0, 0.0, 0.0], abs=0.01)
        ticks.tick(reply())
        assert ticks.torques == [0, 0, 0]

    def test_a_force_that_turns_round_falls_at_once_and_grows_by_steps(self, ticks):
        ticks.open_gate()
        for _ in range(12):
            ticks.tick(reply(), force_n=(5.0, 0.0, 0.0))
        for step in (1, 2, 3):
            ticks.tick(reply(), force_n=(-5.0, 0.0, 0.0))
            assert force_of(ticks, CENTRE_M) == pytest.approx([-step * GROWTH_N, 0.0, 0.0], abs=0.02)

    @pytest.mark.parametrize("along", [1.0, -1.0])
    def test_a_force_that_brakes_the_grip_arrives_within_the_tick_and_one_that_drives_it_does_not(self, ticks, along):
        ticks.open_gate()
        places = np.arange(40) * 0.3e-3  # 0.3 m/s
        for place in places:
            ticks.tick(reply((along * place, 0.0, 0.0)), force_n=(0.0, 0.5, 0.0))
        ticks.tick(reply((along * 12e-3, 0.0, 0.0)), force_n=(4.0, 0.5, 0.0))
        given = force_of(ticks, (along * 12e-3, 0.0, 0.0))
        assert given == pytest.approx([GROWTH_N if along > 0 else 4.0, 0.5, 0.0], abs=0.05)

    def test_the_command_says_what_the_motors_got(self, ticks):
        ticks.open_gate()
        for _ in range(3):
            ticks.tick(reply(SOMEWHERE_M), force_n=PUSH_N)  # still growing
            assert ticks.command[0].sent_n == pytest.approx(force_of(ticks, ticks.position_m), abs=1e-6)
        for _ in range(200):
            ticks.tick(reply(SOMEWHERE_M), force_n=tuple(20 * np.array(PUSH_N)))
        assert ticks.falcon.shortened > 0
        assert ticks.command[0].sent_n == pytest.approx(force_of(ticks, ticks.position_m), abs=1e-6)

    def test_the_command_says_what_the_gate_lets_through(self, ticks):
        ticks.tick(force_n=PUSH_N)
        assert not ticks.command[0].sent_n.any()
        ticks.pull_out()
        for _ in range(100):
            ticks.tick(reply(), force_n=PUSH_N)
        assert 0.1 < ticks.falcon.share < 0.3
        assert ticks.command[0].sent_n == pytest.approx(ticks.falcon.share * np.array(PUSH_N), abs=5e-3)

    def test_the_command_says_what_the_motors_hold_when_a_packet_does_not_go_out(self, ticks):
        ticks.open_gate()
        ticks.tick(reply(), force_n=(0.3, 0.0, 0.0))
        ticks.bridge.write_answer = ERROR_TIMEOUT
        ticks.tick(reply(), force_n=(0.6, 0.0, 0.0))
        assert ticks.command[0].sent_n == pytest.approx([0.3, 0.0, 0.0], abs=5e-3)
        ticks.tick(reply())
        assert ticks.command[0].sent_n == pytest.approx([0.3, 0.0, 0.0], abs=5e-3)

    def test_more_than_the_motors_give_keeps_its_direction(self, ticks):
        ticks.open_gate()
        for _ in range(100):
            ticks.tick(reply(), force_n=tuple(20 * np.array(PUSH_N)))
        assert max(map(abs, ticks.torques)) == MOST_TORQUE
        given = force_of(ticks, CENTRE_M)
        assert given / np.linalg.norm(given) == pytest.approx(PUSH_N / np.linalg.norm(PUSH_N), abs=2e-3)
        assert ticks.falcon.shortened > 50

    @pytest.mark.parametrize("bad", [np.nan, np.inf, 8.1])
    def test_a_force_that_is_no_number_or_beyond_the_limit_is_none(self, ticks, bad):
        ticks.falcon.force_limit_n = 8.0
        ticks.open_gate()
        ticks.tick(reply(), force_n=(1.0, 2.0, 0.0))
        assert ticks.torques != [0, 0, 0]
        ticks.tick(reply(), force_n=(1.0, bad, 0.0))
        assert ticks.torques == [0, 0, 0]

    def test_every_packet_holds_the_homing_flag_and_the_light_of_the_gate(self, ticks):
        def flags_after(*got):
            ticks.tick(*got)
            return ticks.bridge.sent[-1][FLAGS_AT] - ZERO

        ticks.tick()
        assert flags_after(reply(homed=0b011)) == FLAG_HOMING | FLAG_RED
        assert flags_after(reply()) == FLAG_HOMING | FLAG_BLUE
        ticks.pull_out()
        assert flags_after(reply()) == FLAG_HOMING | FLAG_GREEN
        for _ in range(3):
            flags = flags_after(reply(homed=0))
        assert flags == FLAG_HOMING | FLAG_RED
