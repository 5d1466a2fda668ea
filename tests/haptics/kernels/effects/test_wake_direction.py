"""The direction of the wake's push depends neither on the curvature of a stroke nor on tremor (thesis' water)."""

import numpy as np
import pytest

from study_app.haptics.model.motion import Motion
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import COMPILED, WATER, vectors

pytestmark = pytest.mark.skipif(not COMPILED, reason="seconds of motion are for compiled code")
HALF_M = 0.03


def felt_at(places_m):
    """Return the force on a hand in water at these positions (n, 3), one per millisecond."""
    return simulate(WATER, Motion(np.arange(len(places_m)) / 1000, WATER.scale * places_m))


def to_and_fro(excursion_m, *, bow, hz, seconds=4):
    """Return reaches over ±30 mm; ``round``: out on one side, back on the other; ``same``: on one side both ways."""
    phase = 2 * np.pi * hz * np.arange(round(seconds * 1000)) / 1000
    aside = {"round": np.cos(phase), "same": np.cos(phase) ** 2}[bow]
    return np.column_stack([HALF_M * np.sin(phase), 0 * phase, excursion_m * aside])


@pytest.mark.parametrize("hz", [0.5, 1.0, 1.5])
@pytest.mark.parametrize("bow", ["round", "same"])
@pytest.mark.parametrize("kind", ["force", "device"])
def test_reaches_feel_alike_however_far_they_bow(kind, bow, hz):
    means_n = []
    for excursion_m in np.array([0, 0.05, 0.1, 0.2, 0.5, 1, 2, 3, 4, 5]) / 1000:
        table = felt_at(to_and_fro(excursion_m, bow=bow, hz=hz))
        means_n.append(np.linalg.norm(vectors(table, kind)[1000:], axis=1).mean())
    assert means_n[0] > 0.4
    assert max(means_n) - min(means_n) < 0.25 * means_n[0]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("heading", [0.0, 0.7])
@pytest.mark.parametrize("hand_mps", [0.1, 0.2, 0.3])
def test_after_a_stop_tremor_does_not_tick_the_push_away_from_the_motion(hand_mps, heading, seed):
    random = np.random.default_rng(seed)
    times_s = np.arange(4000) / 1000
    along = np.array([np.cos(heading), 0.0, np.sin(heading)])
    trembling = np.zeros((4000, 3))
    for hz in (8.0, 10.0, 12.0):  # 20 µm from end to end, in every direction
        trembling += 10e-6 / 3 * np.sin(2 * np.pi * hz * times_s[:, None] + random.uniform(0, 2 * np.pi, 3))
    table = felt_at(np.outer(hand_mps * np.minimum(times_s, 1.0), along) + trembling)
    push = vectors(table, "force")
    size_n = np.linalg.norm(push, axis=1)
    lasting = (times_s > 1.06) & (size_n > 0.1)
    assert lasting.sum() > 300
    away_deg = np.degrees(np.arccos(np.clip(push[lasting] @ along / size_n[lasting], -1, 1)))
    assert away_deg.max() < 45.0 + 1.0
