"""The reference model, compared with values computed by hand."""

import numpy as np
import pytest

from study_app.evidence.reference_model import respond, wakes
from study_app.haptics.model.effects.wake import Wake
from study_app.haptics.model.estimators import Given
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Liquid, Scene

X, Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


def tail(velocities, *, n=4, s=4.0, y=1.0, beta_deg=45.0, span_m=0.0, decay=1.0, resolution_m=0.0):
    """Return the wake met after these ticks of 1 ms."""
    h = np.array([*velocities, np.zeros(3)])
    interval_s = np.full(len(h), 1e-3)
    position_m = np.cumsum(h * 1e-3, axis=0)
    wake = Wake.model_construct(
        length=n,
        scaling=s,
        exponent=y,
        breaking_angle_deg=beta_deg,
        breaking_span_m=span_m,
        decay=decay,
        resolution_m=resolution_m,
    )
    return wakes(h, position_m, interval_s, wake)[0][-1]


ZERO = np.zeros(3)
SLIGHTLY = np.array([0.8, 0.0, 0.6])  # 36.9° from x
CURVE = [np.array([np.cos(a), 0.0, np.sin(a)]) for a in np.radians([0, 30, 60])]


@pytest.mark.parametrize(
    ("velocities", "changes", "wake"),
    [
        ([], {}, ZERO),
        ([2 * X, SLIGHTLY], {}, SLIGHTLY * 3 / 4),  # one segment: the newest direction with all magnitudes
        ([X, X, Z], {}, [0.5, 0.0, 0.25]),  # two segments add as vectors
        ([X, X, Z, Z, Z], {}, [0.25, 0.0, 0.75]),  # the oldest falls off
        ([X, ZERO, X], {}, [0.5, 0.0, 0.0]),  # zeros take places and break nothing
        ([X, X, ZERO, ZERO, ZERO], {}, [0.25, 0.0, 0.0]),
        ([X, ZERO, ZERO, ZERO, ZERO], {}, ZERO),
        ([X, X], {"decay": 0.5}, [1.5 / 4, 0.0, 0.0]),  # by age
        (CURVE, {}, CURVE[2] * 3 / 4),
        (CURVE, {"span_m": 2e-3}, (2 * CURVE[1] + CURVE[2]) / 4),  # breaks where neighbours would not
        ([X, X], {"y": 2.0}, [0.25, 0.0, 0.0]),  # the response acts on the fill
        ([X, X], {"y": 0.5}, [0.5 * (0.25 + 0.0025) ** -0.25, 0.0, 0.0]),
        ([X] * 4, {"resolution_m": 1.9e-3}, [0.5, 0.0, 0.0]),  # a coarse resolution skips elements
    ],
)
def test_wakes_are_those_worked_out_by_hand(velocities, changes, wake):
    assert tail(velocities, **changes) == pytest.approx(np.asarray(wake))


def test_the_force_is_the_drag_of_the_relative_velocity():
    wake = Wake(length=2, scaling=4, decay=1, breaking_span_m=0)
    liquid = Liquid(id="water", density_kg_m3=1000, effects=("drag", "wake"), wake=wake)
    motion = Motion(np.arange(3) / 1000, np.zeros((3, 3)), velocity_mps=np.tile(X, (3, 1)))
    response = respond(Scene(liquids=(liquid,), velocity=Given()), motion)
    factor = 0.5 * 1000 * 0.47 * np.pi * 0.034**2
    assert response.wake_mps[:, 0] == pytest.approx([0, 0.25, 0.5])
    assert response.force_n[:, 0] == pytest.approx(-factor * np.array([1, 0.75, 0.5]) ** 2)
    assert response.size_mps == pytest.approx([0, 0.25, 0.5])


def test_filtering_other_than_ewma_is_not_defined():
    motion = Motion(np.arange(2) / 1000, np.zeros((2, 3)))
    liquid = Liquid(id="water", density_kg_m3=1000)
    with pytest.raises(TypeError, match="given"):
        respond(Scene(liquids=(liquid,), velocity=Given()), motion)
