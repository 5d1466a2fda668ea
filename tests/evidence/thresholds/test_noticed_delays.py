"""The rated and the detected delay of the same simulated people."""

import pytest

from study_app.evidence.thresholds.noticed_delays import (
    CRITERIA_S,
    JND_S,
    MEAN_CRITERION_S,
    Compared,
    compare_delays,
    draw_people,
    rate_delays,
)
from study_app.protocol.randomization.streams import stream
from study_app.protocol.simulated import OBSERVER, Comparison
from study_app.protocol.trials.designs import default_design

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def comparison() -> Compared:
    return compare_delays(40, 1)


def test_the_forced_choice_finds_the_known_delay_and_the_rating_the_criterion(comparison: Compared) -> None:
    middle, low, high = comparison.detected_ms
    assert low < 1000 * JND_S < high
    assert middle == pytest.approx(1000 * JND_S, rel=0.1)
    plain = [rating for rating in comparison.ratings if not rating.adapted_s]
    thresholds = [float(rating.found.effect or 0.0) for rating in plain]
    assert thresholds == sorted(thresholds)
    for rating, threshold in zip(plain, thresholds, strict=True):
        assert threshold == pytest.approx(1000 * rating.criterion_s, abs=20)
        assert rating.found.lower is not None
        assert rating.found.lower > high
    assert [rating.criterion_s for rating in plain] == list(CRITERIA_S)


def test_adaptation_shifts_ratings_but_not_forced_choices(comparison: Compared) -> None:
    people = draw_people(400, 2)
    before, after = (rate_delays(people, MEAN_CRITERION_S, adapted, 2).found.effect for adapted in (0.0, 0.03))
    assert before is not None
    assert after is not None
    assert before == pytest.approx(1000 * MEAN_CRITERION_S, abs=8)
    assert after - before == pytest.approx(30, abs=12)
    attended, design = Comparison(delays=True, smallest=False, observer=OBSERVER), default_design("2ifc")
    for seed in range(50):
        chosen = [
            attended.choose(design, [0.2 - shift, 0.22 - shift], 0.0, stream(seed, "x").random) for shift in (0.0, 0.03)
        ]
        assert chosen[0] == chosen[1]
