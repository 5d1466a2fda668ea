"""Levels set on the real servo and simulated devices, on a virtual clock: forces, device buttons, the time limit."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from study_app.devices.rig import Rig, open_rig, study_settings
from study_app.haptics.model.layout import LIMITER_FADE
from study_app.haptics.model.slope_limits import SLEW_N
from study_app.haptics.runtime.clocks.clock import VirtualClock
from study_app.protocol.orders.schedule import stream
from study_app.session.device_buttons import ANSWERS, CONTINUE
from study_app.session.transitions.events import PauseRequested, Stepped, Submitted
from study_app.session.transitions.state import Phase
from tests.compiled import needs_servo
from tests.protocol.trials.matching import ALONE, DELAY, matching
from tests.session.runner.bench import Bench

pytestmark = needs_servo

EXPLORED = ('kind = "follow"\ncycles = 1', 'kind = "explore"\nmin_s = 1\nmax_s = 2\ninstruction = "Stir."')
UNJUDGED = ("[liquids", "[limits]\nlevel_error_percent = 100\nwithheld_percent = 100\n\n[liquids")
LESS, MORE = ANSWERS
STILL_N = 1e-9


@pytest.fixture(params=["scripted", pytest.param("falcon-emulated", marks=pytest.mark.slow)])
def rig(request: pytest.FixtureRequest) -> Iterator[Rig]:
    settings = study_settings(matching(), stream(1, "hand"))
    with open_rig(request.param, settings, clock=VirtualClock()) as opened:
        yield opened


def at_setting(rig: Rig, *edits: tuple[str, str]) -> Bench:
    """Return a session whose first level is being set, its hand in motion."""
    made = Bench(rig, matching(EXPLORED, UNJUDGED, *edits))
    made.swing()
    for _ in range(500):
        if made.state.adjusts and made.state.phase is Phase.TASK:
            return made
        made.run(0.02)
    raise AssertionError(made.state.phase)


def samples_of(bench: Bench, seconds: float) -> Any:
    """Let time pass and return the samples."""
    bench.reader.read()
    found = []
    for _ in range(round(seconds * 50)):
        bench.servo.advance(20)
        bench.runner.poll()
        found.append(bench.reader.read().copy())
    return np.concatenate(found)


def damping(samples: Any) -> float:
    """Return b of F = −b v, by least squares [N·s/m]; the device moves a tenth as fast as the scene."""
    v = samples["velocity_mps"] / 10
    return float(-(samples["device_force_n"] * v).sum() / (v * v).sum())


def test_steps_change_the_damping_in_the_hand_and_the_force_goes_on(rig: Rig) -> None:
    bench = at_setting(rig)
    samples_of(bench, 0.5)
    setting = bench.state.adjusting
    assert setting is not None
    before = samples_of(bench, 0.3)
    assert damping(before) == pytest.approx(setting.comparison(0), rel=0.03)
    way = -1 if setting.comparison(0) > 6 else 1
    bench.runner.post(Stepped(bench.clock(), 10 * way))
    after = samples_of(bench, 0.3)
    assert damping(after[100:]) == pytest.approx(setting.comparison(10 * way), rel=0.03)
    assert {*after["scene"]} == {before["scene"][-1] + 1}
    whole = np.concatenate([before, after])
    assert np.linalg.norm(np.diff(whole["device_force_n"], axis=0), axis=1).max() < 2 * SLEW_N
    assert not (after["limiters"] & LIMITER_FADE).any()
    (line,) = bench.journal.of("stepped")
    assert (line["steps"], line["scene"]) == (10 * way, int(after["scene"][0]))


def test_every_step_is_a_scene_of_its_own_at_the_ends_too(rig: Rig) -> None:
    bench = at_setting(rig)
    samples_of(bench, 0.1)
    for steps in (500, 3, -500, -3):
        bench.runner.post(Stepped(bench.clock(), steps))
        samples_of(bench, 0.02)
    scenes = [line["scene"] for line in bench.journal.of("stepped")]
    assert scenes == [*range(scenes[0], scenes[0] + 4)]


def test_force_is_zero_in_the_rest_before_and_after_and_in_a_pause(rig: Rig) -> None:
    bench = Bench(rig, matching(EXPLORED, UNJUDGED))
    bench.swing()
    bench.run_to(Phase.RESTING)
    bench.run(0.06)
    assert bench.run(0.4).max() < STILL_N
    bench.run_to(Phase.TASK)
    assert bench.run(0.8).max() > 0.1
    bench.runner.post(PauseRequested(bench.clock(), "participant"))
    bench.run(0.06)
    assert bench.run(0.4).max() < STILL_N


def test_after_the_confirmation_steps_have_no_effect_and_the_force_fades_out(rig: Rig) -> None:
    bench = at_setting(rig)
    bench.run(1.2)
    bench.runner.post(Submitted(bench.clock()))
    bench.runner.post(Stepped(bench.clock(), 5))
    assert bench.state.phase is Phase.TASK
    assert not bench.journal.of("stepped")
    bench.run_to(Phase.RESTING)
    bench.run(0.06)
    assert bench.run(0.4).max() < STILL_N
    (answer,) = bench.journal.of("responses")
    assert answer["items"][0]["value"] == 0


def test_a_confirmation_within_the_first_second_is_too_early(rig: Rig) -> None:
    bench = at_setting(rig)
    bench.run(0.5)
    bench.runner.post(Submitted(bench.clock()))
    bench.run(1.0)
    assert bench.state.phase is Phase.TASK
    assert bench.state.adjusts


def test_device_buttons_step_held_eight_times_a_second_and_the_first_confirms(rig: Rig) -> None:
    bench = at_setting(rig)
    bench.run(0.1)
    bench.hand.press(MORE)
    bench.run(1.01)
    bench.hand.release()
    bench.run(0.5)
    steps = [line["steps"] for line in bench.journal.of("stepped")]
    assert set(steps) == {1}
    assert 8 <= len(steps) <= 10
    bench.hand.press(LESS)
    bench.run(0.05)
    bench.hand.release()
    bench.run(0.1)
    assert [line["steps"] for line in bench.journal.of("stepped")][len(steps) :] == [-1]
    bench.hand.press(CONTINUE)
    bench.run(0.4)
    (answer,) = bench.journal.of("responses")
    assert answer["items"][0]["value"] == len(steps) - 1


def test_a_button_that_is_down_since_before_the_interval_makes_no_step(rig: Rig) -> None:
    bench = Bench(rig, matching(EXPLORED, UNJUDGED))
    bench.swing()
    bench.run_to(Phase.RESTING)
    bench.hand.press(MORE)
    bench.run_to(Phase.TASK)
    bench.run(0.5)
    assert not bench.journal.of("stepped")


def test_the_setting_ends_with_its_time(rig: Rig) -> None:
    bench = at_setting(rig, ("repetitions = 4", "repetitions = 4\nmost_s = 2"))
    bench.runner.post(Stepped(bench.clock(), -1))
    bench.run(2.3)
    assert bench.state.phase is Phase.RESTING
    ended = bench.journal.of("interval_ended")[-1]
    assert (ended["outcome"], ended["duration_s"]) == ("timeout", pytest.approx(2.0, abs=0.002))
    assert ended["value_delivered"] is None
    assert ended["force_share"] == pytest.approx(1.0, abs=0.02)
    (answer,) = bench.journal.of("responses")
    assert answer["items"][0]["value"] == -1


def test_a_delay_is_set_in_the_picture_and_no_scene_changes(rig: Rig) -> None:
    bench = at_setting(rig, ALONE, DELAY)
    samples_of(bench, 0.3)
    setting = bench.state.adjusting
    assert setting is not None

    def age_ms() -> float:
        view = bench.runner.view(bench.servo.now_ns())
        assert view is not None
        return (bench.servo.now_ns() - view.sample_time_ns) / 1e6 - 2

    assert age_ms() == pytest.approx(setting.comparison(0), abs=0.01)
    way = 12 if setting.comparison(0) < 60 else -12
    bench.runner.post(Stepped(bench.clock(), way))
    assert age_ms() == pytest.approx(setting.comparison(way), abs=0.01)
    assert bench.journal.of("stepped")[0]["scene"] is None
    assert len({*samples_of(bench, 0.1)["scene"]}) == 1
