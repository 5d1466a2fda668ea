"""Which limits an interval breaks, by its samples: level, clipping, pace, and the difference of two delays."""

from typing import Any

import numpy as np
import pytest

from study_app.haptics.model.layout import LIMITER_GLITCH, LIMITER_NORM, SAMPLE
from study_app.protocol.load import parse
from study_app.protocol.model import Protocol
from study_app.protocol.trials.presentation import Presentation
from study_app.protocol.trials.stimuli import Stimulated
from study_app.store.delivered import delay_error_ms, delivered, delivered_error, judged, missed, undelivered

STUDY = """\
format = 2
study.name = "delivered"
scene.fade_s = 0.3
[liquids.damper]
drag = { law = "linear", damping_nspm = 8 }
[tasks.follow]
kind = "follow"
[tasks.stir]
kind = "explore"
min_s = 1
max_s = 4
instruction = "Stir."
[stimuli.damping]
vary = "damping_nspm"
levels = [0.02, 0.6]
[blocks.thicker]
task = "follow"
stimulus = "damping"
design = "2ifc"
method = "constant"
[blocks.stirred]
task = "stir"
stimulus = "damping"
design = "2ifc"
method = "constant"
"""
DAMPING = Stimulated("damper", "damping_nspm", 8.0)
VISCOSITY = Stimulated("damper", "viscosity_pa_s", 4.0)
DELAY = Stimulated("damper", "delay_ms", 50.0)
FORCE_DELAY = Stimulated("damper", "force_delay_ms", 50.0)


@pytest.fixture(scope="module")
def protocol() -> Protocol:
    return parse(STUDY.encode(), "delivered.toml")


def samples(b_nspm: float = 8.0, *, pace: float = 1.0, lasts_s: float = 4.0) -> Any:
    """Return an interval of the paced motion, its amplitude ``pace`` times the target's, through an exact damper."""
    found = np.zeros(round(1000 * lasts_s), SAMPLE)
    t_s = np.arange(len(found)) * 1e-3
    found["time_ns"] = 5_000_000_000 + np.arange(len(found)) * 1_000_000
    found["position_m"][:, 0] = pace * 0.02 * np.sin(2 * np.pi * t_s)
    found["force_n"][:, 0] = -b_nspm * pace * 0.02 * 2 * np.pi * np.cos(2 * np.pi * t_s)
    found["device_force_n"] = found["force_n"]
    return found


def reasons(protocol: Protocol, found: Any, presented: Stimulated = DAMPING, task: str = "follow") -> list[str]:
    done = protocol.tasks[task]
    return [*undelivered(protocol.limits, presented, done, delivered(protocol, presented, done, judged(found)))]


@pytest.mark.parametrize(
    ("b_nspm", "broken"),
    [(8.0, []), (8.15, []), (7.85, []), (8.17, ["level_error_percent"]), (7.83, ["level_error_percent"])],
)
def test_a_damping_is_judged_by_its_limit(protocol: Protocol, b_nspm: float, broken: list[str]) -> None:
    assert reasons(protocol, samples(b_nspm)) == broken


@pytest.mark.parametrize(("share", "broken"), [(1.0, []), (0.985, []), (0.97, ["level_error_percent"])])
def test_another_number_is_judged_by_the_share_of_its_force(
    protocol: Protocol, share: float, broken: list[str]
) -> None:
    found = samples()
    found["device_force_n"] *= share
    assert reasons(protocol, found, VISCOSITY) == broken
    assert reasons(protocol, found, DELAY) == []


@pytest.mark.parametrize(("pace", "broken"), [(0.62, []), (1.38, []), (0.58, True), (1.42, True)])
def test_the_pace_is_judged_where_there_is_one(protocol: Protocol, pace: float, broken: object) -> None:
    assert reasons(protocol, samples(pace=pace)) == (["pace_error_percent"] if broken else [])
    assert reasons(protocol, samples(pace=pace), task="stir") == []


@pytest.mark.parametrize(
    ("task", "at_s", "broken"),
    [("follow", 0.9, []), ("follow", 1.1, ["force_limit_n"]), ("stir", 0.4, []), ("stir", 0.6, ["force_limit_n"])],
)
def test_clipping_counts_after_the_lead_or_the_fade(
    protocol: Protocol, task: str, at_s: float, broken: list[str]
) -> None:
    found = samples()
    found["limiters"][round(1000 * at_s)] = LIMITER_NORM
    assert reasons(protocol, found, task=task) == broken
    assert reasons(protocol, found, DELAY, task) == []


def test_the_fade_and_refused_positions_are_not_judged(protocol: Protocol) -> None:
    found = samples()
    found["device_force_n"][:1000] = 0
    found["position_m"][2000:2003] = 1.0
    found["limiters"][2000:2003] = LIMITER_GLITCH
    assert reasons(protocol, found) == []
    found["limiters"] = 0
    assert "level_error_percent" in reasons(protocol, found)


@pytest.mark.parametrize(
    ("errors_ms", "holds", "broken"),
    [
        ([6.0, 7.9], (False, True), []),
        ([6.0, 8.1], (False, True), ["level_error_ms"]),
        ([8.1, 6.0], (True, False), ["level_error_ms"]),
        ([6.0], (False, True), []),
        ([6.0, 60.0], (True, True), []),
        ([6.0, None], (False, True), []),
    ],
)
def test_delays_are_judged_by_the_difference_of_their_errors(
    protocol: Protocol, errors_ms: list[float | None], holds: tuple[bool, ...], broken: list[str]
) -> None:
    assert [*missed(protocol.limits, Presentation(10.0, 50.0, 0, (DELAY, DELAY)), holds, errors_ms, 1000.0)] == broken
    assert [*missed(protocol.limits, Presentation(0.1, 8.0, 0, (DAMPING, DAMPING)), holds, errors_ms, 1000.0)] == []


def late(delay: int, b_nspm: float = 8.0) -> Any:
    """Return the interval with a force that is sent so many ticks late."""
    found = samples(b_nspm)
    found["device_force_n"][delay:] = found["force_n"][: len(found) - delay]
    found["device_force_n"][:delay] = 0
    return found


@pytest.mark.parametrize("delay", [0, 15, 250])
@pytest.mark.parametrize("task", ["follow", "stir"])
def test_the_delay_of_a_force_is_measured(protocol: Protocol, delay: int, task: str) -> None:
    presented = Stimulated("damper", "force_delay_ms", float(min(delay, 200)))
    found = delivered(protocol, presented, protocol.tasks[task], judged(late(delay)))
    assert found.value_delivered == pytest.approx(delay, abs=0.05)
    assert found.force_share == pytest.approx(1.0, abs=1e-4)  # of the force that belongs to it
    assert delay_error_ms(presented, found.columns) == pytest.approx(delay - presented.value, abs=0.05)
    assert reasons(protocol, late(delay), presented, task) == []


def test_a_lost_sample_does_not_shift_the_delay_of_a_force(protocol: Protocol) -> None:
    found = late(30)
    found["limiters"][2100] = LIMITER_GLITCH
    found["position_m"][2100] = 1.0
    whole = np.delete(found, range(2500, 2510))
    measured = delivered(protocol, FORCE_DELAY, protocol.tasks["follow"], judged(whole))
    assert measured.value_delivered == pytest.approx(30, abs=0.2)


def test_a_damping_is_measured_by_the_motion_that_its_late_force_belongs_to(protocol: Protocol) -> None:
    """100 ms late, a damper of 8 N·s/m would measure as 6.5 at 1 Hz."""
    slow = parse(
        STUDY.replace("[tasks.follow]", '[conditions.late]\nliquid = "damper"\nforce_delay_ms = 100\n[tasks.follow]')
        .replace("[stimuli.damping]", '[stimuli.damping]\ncondition = "late"')
        .replace("= 8 }", "= 2 }")
        .encode(),
        "late.toml",
    )
    presented = Stimulated("late", "damping_nspm", 2.0)
    found = delivered(slow, presented, slow.tasks["follow"], judged(late(100, 2.0)))
    assert found.value_delivered == pytest.approx(2.0, rel=1e-3)
    assert found.force_share == pytest.approx(1.0, rel=1e-4)


def test_jitter_and_loss_are_taken_as_requested_and_clipping_still_counts(protocol: Protocol) -> None:
    presented = Stimulated("damper", "force_loss", 0.3)
    found = late(3)
    assert delivered(protocol, presented, protocol.tasks["follow"], judged(found)).value_delivered == 0.3
    assert reasons(protocol, found, presented) == []
    found["limiters"][2000] = LIMITER_NORM
    assert reasons(protocol, found, presented) == ["force_limit_n"]


def error(found: Any, fade_s: float = 0.3, b_nspm: float = 8.0) -> float | None:
    return delivered_error(judged(found), 1000.0, fade_s, lambda _t_s, _x_m, v_mps: -b_nspm * v_mps)


def test_the_error_of_the_force_sent_is_its_difference_from_the_law_on_the_motion():
    assert error(samples()) == pytest.approx(0.0, abs=2e-3)
    weak, late, counted = samples(), samples(), samples()
    weak["device_force_n"] *= 0.9
    assert error(weak) == pytest.approx(0.1, abs=2e-3)
    late["device_force_n"] = np.roll(late["force_n"], 10, axis=0)
    assert error(late) == pytest.approx(2 * np.sin(np.pi * 0.01), rel=0.03)
    counted["position_m"] = np.rint(counted["position_m"] / 38e-6) * 38e-6
    assert error(counted) == pytest.approx(0.0, abs=0.01)
    quick, t_s = samples(), np.arange(4000) * 1e-3
    quick["position_m"][:, 1] = 0.002 * np.sin(2 * np.pi * 10 * t_s)
    quick["device_force_n"][:, 1] = -8.0 * 0.002 * 2 * np.pi * 10 * np.cos(2 * np.pi * 10 * t_s)
    assert error(quick) == pytest.approx(0.0, abs=0.02)  # the smoother passes it
    counted["position_m"][1000] += 0.02
    counted["limiters"][1000] = LIMITER_GLITCH
    assert error(counted) == pytest.approx(0.0, abs=0.01)


def test_the_error_counts_after_the_fade_and_where_a_force_is_felt():
    faded = samples()
    faded["device_force_n"][:480] = 0.0
    assert error(faded) == pytest.approx(0.0, abs=2e-3)
    assert error(faded, fade_s=0.1) > 0.1
    assert error(samples(lasts_s=0.4)) is None
    assert error(samples(lasts_s=0.0)) is None
    assert error(samples(pace=0.001)) is None
    assert error(samples(pace=0.001), b_nspm=8000.0) is not None
