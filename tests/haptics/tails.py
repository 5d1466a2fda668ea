"""Wakes for tests: strategies that draw them, walks that fill them, and how far the product is from the definition."""

from typing import Any

import numpy as np
from hypothesis import strategies as st

from study_app.evidence.reference_model import respond
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.kernels.tick import compute_tick
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Scene
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import COMPILED, TICK_NS, UNBENT, Hand, liquid, moving, scene, vectors

LONGEST = 500 if COMPILED else 12
TICKS = 1500 if COMPILED else 60
NOTHING_MPS = 1e-20  # far below anything felt; the product lets a tail of 1e-30 m/s be none


def tank(**wake: Any) -> Scene:
    """Return a scene of water with this wake, decay, span and knee off unless named."""
    plain = {"length": 100, "scaling": 100, "decay": 1.0, "breaking_span_m": 0.0}
    return scene(liquid(wake={**plain, **wake}), knee=UNBENT)


@st.composite
def wakes(draw: Any, lengths: Any = st.integers(1, LONGEST)) -> dict[str, Any]:  # noqa: B008
    """Draw parameters of a wake, edges included."""
    length = draw(lengths)
    return {
        "length": length,
        "scaling": length * draw(st.sampled_from([1.0, 1.5, 10.0])),
        "exponent": draw(st.sampled_from([0.25, 0.75, 1.0, 2.0, 4.0])),
        "breaking_angle_deg": draw(st.sampled_from([0.0, 30.0, 45.0, 60.0, 90.0, 120.0, 180.0])),
        "breaking_span_m": draw(st.sampled_from([0.0, 1e-3, 0.02, 0.068, 1.0])),
        "decay": draw(st.sampled_from([1.0, 0.999975, 0.99, 0.8])),
        "resolution_m": draw(st.sampled_from([0.0, 0.0, 1e-3, 0.05])),
        "axes": draw(st.sampled_from(["xz", "xyz"])),
    }


LEG = st.tuples(
    st.integers(1, TICKS // 4),  # ticks
    st.sampled_from([0.0, 9.99e-4, 1e-3, 1.01e-3, 0.03, 1.0, 1.0, 7.0, 60.0]),  # speed [m/s]
    st.sampled_from([0, 30, 45, 60, 90, 120, 180, -45, 44.999, 45.001]),  # turn at its beginning [°]
    st.sampled_from([0.0, 0.0, 0.6, 20.0, 45.0, 180.0]),  # turn in every tick [°]
    st.sampled_from([0.0, 0.0, 0.5, -2.0]),  # rise
)
LEGS = st.lists(LEG, min_size=1, max_size=40)
PACES = {"even": [1.0], "jitter": [1.0, 0.7, 1.3, 0.1, 2.0], "late": [1.0] * 30 + [30.0, 5.0]}


def walk(legs: Any, pace: str = "even") -> Motion:
    """Return a motion of bursts, rests, creeping, reversals, turns and curves, with even or uneven time steps."""
    velocities, heading = [], 0.0
    for ticks, speed, turn, curve, rise in legs:
        heading += np.radians(turn)
        headings = heading + np.radians(curve) * np.arange(ticks)
        velocities.append(speed * np.column_stack([np.cos(headings), np.full(ticks, rise), np.sin(headings)]))
        heading += np.radians(curve) * ticks
    rows = np.concatenate(velocities)[:TICKS]
    return moving(rows, 1e-3 * np.resize(PACES[pace], len(rows)))


def difference(scene: Scene, motion: Motion) -> float:
    """Return the greatest |wake − definition| in units of Σ|e|/S, and check that the force follows."""
    table, literal = simulate(scene, motion), respond(scene, motion)
    error = np.linalg.norm(vectors(table, "wake") - literal.wake_mps, axis=1)
    assert not error[literal.size_mps == 0].any()
    assert (error[literal.size_mps < NOTHING_MPS] <= NOTHING_MPS).all()
    force = np.linalg.norm(literal.force_n, axis=1, keepdims=True)
    assert (abs(vectors(table, "force") - literal.force_n) <= 1e-9 * np.maximum(force, 1e-3)).all()
    some = literal.size_mps >= NOTHING_MPS
    return float((error[some] / literal.size_mps[some]).max(initial=0.0))


def pass_time(hand: Hand, places_m: Any, ticks: int, *, after_ns: int = TICK_NS) -> Any:
    """Move a hand around ``places_m`` (n, 3) for many ticks at once; return the last sample."""
    _pass_time(hand.model, hand.safety[0], hand.sample[0], np.atleast_2d(places_m), ticks, after_ns)
    hand.time_ns = int(hand.sample[0].time_ns)
    return hand.sample.copy()[0]


def all_numbers(model: Any) -> Any:
    """Return all floating-point numbers of a model's state, (n,)."""

    def flat(record: Any) -> list[Any]:
        if record.dtype.names:
            return [value for name in record.dtype.names for value in flat(record[name])]
        return [record.ravel()] if record.dtype == np.float64 else []

    return np.concatenate([value for rows in model.arrays[2:] for value in flat(np.asarray(rows))])


@kernel
def _pass_time(model: Any, safety: Any, sample: Any, places_m: Any, ticks: int, after_ns: int) -> None:
    for k in range(ticks):
        sample.time_ns += after_ns
        sample.fresh = 1
        for axis in range(3):
            sample.position_m[axis] = places_m[k % len(places_m), axis]
        compute_tick(model, safety, sample)
