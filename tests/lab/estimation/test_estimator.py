"""Planted values are found in measured force, and only where the motion shows them."""

import numpy as np
import pytest

from study_app.errors import StudyError
from study_app.haptics.model.effects.drag import Drag
from study_app.lab.estimation.estimator import OnlineEstimator
from study_app.lab.estimation.fits import DRAG, NAMES, LiquidModel
from study_app.lab.estimation.sources import CentredVelocity, Rows, joined
from study_app.protocol.load import load_scene
from tests.lab.estimation.measured import NOISE_N, WATER, fed, measured, planted, stirring, wandering

pytestmark = pytest.mark.slow

WHOLE = 1700  # of water


def still(seconds: float = 5.0) -> Rows:
    t_s = np.arange(round(1000 * seconds)) / 1000
    return measured(WATER, t_s, np.zeros((len(t_s), 3)))


def steady_circle(seconds: float = 10.0) -> Rows:
    """Return a hand on a circle at a constant speed, whose wake never fills."""
    t_s = np.arange(round(1000 * seconds)) / 1000
    places = np.column_stack([0.26 * np.cos(4 * t_s), 0 * t_s, 0.26 * np.sin(4 * t_s)])
    return measured(planted(drag=0.42, length=7000, scaling=7000), t_s, places)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_drag_coefficient_is_found_within_its_interval(seed: int) -> None:
    rows = measured(planted(drag=0.42, length=WHOLE, scaling=WHOLE), *stirring(), seed=seed)
    found = fed(OnlineEstimator(WATER), rows)
    lower, upper = found.intervals[DRAG]
    assert WATER.body.drag_coefficient == pytest.approx(0.47)
    assert found.identified
    assert found.values[DRAG] == pytest.approx(0.42, rel=0.01)
    assert lower < 0.42 < upper
    assert found.rms_n == pytest.approx(NOISE_N * np.sqrt(3), rel=0.05)


def test_a_stream_without_noise_leaves_no_residual() -> None:
    rows = measured(planted(drag=1.0, length=WHOLE, scaling=WHOLE), *stirring(4.0), noise_n=0.0)
    found = fed(OnlineEstimator(WATER), rows)
    assert (found.values[DRAG], found.rms_n) == (pytest.approx(1.0, rel=1e-3), pytest.approx(0.0, abs=1e-3))


def test_drag_length_and_scaling_are_found_together() -> None:
    found = fed(OnlineEstimator(WATER, NAMES), measured(planted(), *stirring()))
    assert found.identified
    assert found.values == {
        DRAG: pytest.approx(0.42, rel=0.02),
        "length": pytest.approx(1200, rel=0.05),
        "scaling": pytest.approx(1500, rel=0.05),
    }


def test_a_search_leaves_a_minimum_that_is_not_the_least() -> None:
    """Of this motion: Gauss–Newton from the setting's own wake alone ends at a length of 1382."""
    t_s, places = wandering(np.random.default_rng(21))
    found = fed(OnlineEstimator(WATER, NAMES), measured(planted(drag=0.8, length=2354, scaling=4640), t_s, places))
    assert found.identified
    assert found.values["length"] == pytest.approx(2354, rel=0.01)


def test_a_stream_of_positions_at_another_rate_is_enough() -> None:
    rows = measured(planted(drag=0.42, length=WHOLE, scaling=WHOLE), *stirring(rate_hz=500.0))
    centred = CentredVelocity()
    found = OnlineEstimator(WATER)
    for first in range(0, len(rows), 17):
        part = rows.part(first, first + 17)
        found.take(centred.take(part.t_s, part.position_m, part.force_n))
    assert found.estimate.identified
    assert found.estimate.values[DRAG] == pytest.approx(0.42, rel=0.01)


def test_a_hand_at_rest_identifies_nothing() -> None:
    found = fed(OnlineEstimator(WATER), still())
    assert not found.identified
    assert "does not move" in found.reason
    assert fed(OnlineEstimator(WATER, NAMES), still()).reason


def test_a_wake_that_never_ends_has_no_length() -> None:
    found = fed(OnlineEstimator(planted(drag=0.47, length=5000, scaling=5000), NAMES), steady_circle())
    assert not found.identified
    assert "wake" in found.reason or "length" in found.reason


def test_a_wrong_wake_is_not_taken_for_drag() -> None:
    found = fed(OnlineEstimator(WATER), measured(planted(), *stirring()))
    assert not found.identified
    assert "the model misses" in found.reason


def test_forgetting_follows_a_change() -> None:
    t_s, places = stirring(30.0)
    before, after = (measured(planted(drag=it, length=WHOLE, scaling=WHOLE), t_s, places) for it in (0.30, 0.60))
    rows = joined(before.part(0, 10_000), after.part(10_000))
    assert fed(OnlineEstimator(WATER, memory_s=2.0), rows).values[DRAG] == pytest.approx(0.60, rel=0.02)
    assert fed(OnlineEstimator(WATER, memory_s=600.0), rows).values[DRAG] < 0.55


def test_recursion_is_weighted_least_squares() -> None:
    rows = measured(planted(drag=0.42, length=WHOLE, scaling=WHOLE), *stirring(4.0))
    g_n, h_n = LiquidModel(WATER, 1000.0).follow(rows)
    weights = np.exp((rows.t_s - rows.t_s[-1]) / 3.0)[:, np.newaxis]
    by_hand = np.sum(weights * g_n * (rows.force_n - h_n)) / np.sum(weights * g_n * g_n)
    for batch in (7, 4000):
        assert fed(OnlineEstimator(WATER, memory_s=3.0), rows, batch).values[DRAG] == pytest.approx(by_hand, rel=1e-9)


def test_other_forces_are_not_taken_for_drag() -> None:
    liquid = WATER.liquids[0].model_copy(update={"effects": ("drag", "wake", "added_mass")})
    scene = WATER.model_copy(update={"liquids": (liquid,)})
    rows = measured(planted(scene, drag=0.42, length=WHOLE, scaling=WHOLE), *stirring())
    assert fed(OnlineEstimator(scene), rows).values[DRAG] == pytest.approx(0.42, rel=0.01)


def test_a_force_of_the_wrong_sign_is_refused() -> None:
    rows = measured(WATER, *stirring(4.0))
    found = fed(
        OnlineEstimator(WATER),
        Rows(
            t_s=rows.t_s,
            position_m=rows.position_m,
            velocity_mps=rows.velocity_mps,
            force_n=-rows.force_n,
            usable=rows.usable,
        ),
    )
    assert not found.identified
    assert "check its signs" in found.reason


def test_laws_without_the_coefficient_are_refused() -> None:
    liquid = WATER.liquids[0].model_copy(update={"drag": Drag(law="linear", damping_nspm=5.0)})
    with pytest.raises(StudyError, match='"linear" does not use the drag coefficient'):
        OnlineEstimator(WATER.model_copy(update={"liquids": (liquid,)}))
    with pytest.raises(StudyError, match="no effect wake"):
        OnlineEstimator(load_scene("rek2024", "honey"), NAMES)
    with pytest.raises(StudyError, match="cannot be estimated online"):
        OnlineEstimator(WATER, (DRAG, "decay"))


def test_a_measurement_that_is_short_slow_or_interrupted_is_said() -> None:
    rows = measured(WATER, *stirring(4.0))
    assert fed(OnlineEstimator(WATER), rows.part(0, 300)).reason.startswith("0.3 s measured, ")
    slow, gaps = (Rows(**{it: getattr(rows, it)[::step] for it in Rows.__slots__}) for step in (40, 100))
    with pytest.raises(StudyError, match="rows per second"):
        fed(OnlineEstimator(WATER), slow)
    interrupted = fed(OnlineEstimator(WATER), gaps)
    assert interrupted.reason.startswith("no force was measured for 0.1 s, at most 0.05 s are permitted")
    assert interrupted.values == {}
