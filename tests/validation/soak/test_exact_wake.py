"""The wake as it follows from telemetry alone, against its slow definition."""

import math

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("the servo exists compiled only", allow_module_level=True)

from study_app.evaluation.reference_model import wakes
from study_app.haptics.model.effects.current import Uniform
from study_app.haptics.model.effects.wake import Wake
from study_app.haptics.model.layout import LIMITER_GLITCH, SAMPLE, records
from study_app.haptics.model.scene import Box, Liquid, Scene
from study_app.validation.soak.exact_wake import Ledger, wake_of
from study_app.validation.soak.wake_drift import Drift

PERIOD_NS = 1_000_000


def walked(scene, ticks, seed):
    """Return samples of a random walk and, by the slow definition, the wake each of them meets."""
    random = np.random.default_rng(seed)
    speed = np.repeat(random.choice([0.0, 5e-4, 0.05, 1.0, 4.0], ticks // 25), 25)
    heading = np.cumsum(np.where(random.random(ticks) < 0.03, random.uniform(-np.pi, np.pi, ticks), 0.01))
    made = records(SAMPLE, ticks)
    made.fresh, made.scene, made.tick = 1, 1, np.arange(ticks)
    made.time_ns = np.cumsum(random.choice([PERIOD_NS, 1_300_000, 30_000_000], ticks, p=[0.8, 0.15, 0.05]))
    made.velocity_mps = np.column_stack([speed * np.cos(heading), random.normal(size=ticks), speed * np.sin(heading)])
    interval_s = np.clip(np.diff(made.time_ns, prepend=made.time_ns[0] - PERIOD_NS) * 1e-9, 2e-4, 0.02)
    interval_s[0] = 1e-3
    made.position_m = np.cumsum(made.velocity_mps * interval_s[:, None], axis=0) / scene.scale
    wake = scene.liquids[0].wake
    vertical = 1.0 if wake.axes == "xyz" else 0.0
    made.wake_mps, _ = wakes(
        made.velocity_mps * np.array([1.0, vertical, 1.0]),
        made.position_m * scene.scale,
        interval_s,
        wake.length,
        wake.scaling,
        wake.exponent,
        math.cos(math.radians(wake.breaking_angle_deg)),
        wake.breaking_span_m,
        wake.decay,
        wake.resolution_m,
    )
    return made


def tank(**wake):
    plain = {"length": 80, "scaling": 100}
    return Scene(liquids=(Liquid(id="tank", density_kg_m3=1000, effects=("drag", "wake"), wake=Wake(**plain | wake)),))


@pytest.mark.parametrize(
    "wake",
    [
        {},
        {"exponent": 0.25, "breaking_span_m": 0.068},
        {"exponent": 2.0, "decay": 0.99, "breaking_angle_deg": 10},
        {"axes": "xyz", "breaking_span_m": 0.02},
        {"resolution_m": 0.01},
        {"length": 1, "decay": 1.0},
    ],
)
def test_the_ledger_equals_the_slow_definition(wake):
    scene = tank(**wake)
    made, ledger = walked(scene, 3000, seed=3), Ledger(scene)
    errors = [ledger.take(part) for part in np.split(made, range(137, 3000, 137))]
    assert max(error for error in errors if error is not None) < 1e-12
    assert sum(error is not None for error in errors) > 5


def test_a_wake_that_is_no_number_is_as_far_off_as_can_be():
    scene = tank()
    made = walked(scene, 500, seed=4)
    made.wake_mps[-1, 0] = math.nan
    assert Ledger(scene).take(made) == math.inf


def test_a_refused_reading_is_passed_over_and_five_empty_the_wake():
    scene = tank()
    made = walked(scene, 500, seed=4)
    for refused, empties in ((4, False), (5, True)):
        bad = made[: refused + 1].copy()
        bad.limiters[:refused] = LIMITER_GLITCH
        bad.position_m[:refused] = math.nan
        ledger = Ledger(scene)
        ledger.take(made)
        before, _ = ledger.definition()
        bad.wake_mps[refused] = 0.0 if empties else before
        error = ledger.take(bad)
        assert error is None if empties else error < 1e-12
        assert (ledger.age_s < 0.01) is empties


def test_drift_follows_scenes_and_no_further_than_the_samples_go():
    scene = tank()
    made, drift = walked(scene, 600, seed=5), Drift()
    drift.expect(1, scene)
    drift.take(made[:300])
    assert (drift.comparisons, drift.worst < 1e-12) == (1, True)
    drift.take(made[301:])
    assert drift.comparisons == 1
    drift.expect(2, scene)
    made.scene[560:] = 2
    drift.take(made)
    assert drift.comparisons == 2
    assert drift.worst > 1e-6, "the wake goes on where the scene began anew"


def test_only_a_wake_that_telemetry_tells_all_about_is_written_down():
    plain = tank().liquids[0]
    assert wake_of(tank()) == plain.wake
    for changed in (
        {"effects": ("drag",)},
        {"effects": ("drag", "wake", "current"), "current": Uniform(velocity_mps=(1, 0, 0))},
        {"region": Box(size_m=(1, 1, 1))},
    ):
        assert wake_of(Scene(liquids=(plain.model_copy(update=changed),))) is None
    assert wake_of(Scene()) is None
