"""What one answer stands for: repetitions, sessions and conditions of one delay are said, and never pooled silently."""

import json

import numpy as np
import pytest

from study_app.analysis.evaluate import evaluate
from study_app.analysis.export.codebook import codebook_bytes
from study_app.analysis.findings.contrast_with_control import FINDING as CONTRASTS
from study_app.analysis.findings.delay_trend import FINDING as TREND
from study_app.analysis.findings.detection_threshold import FINDING as THRESHOLD
from study_app.analysis.findings.factors.session_comparison import FINDING as SESSIONS
from study_app.analysis.findings.other_assumptions import FINDING as AGAIN
from study_app.analysis.findings.settings_differ import FINDING as OMNIBUS
from study_app.analysis.report.block_section import block
from study_app.analysis.report.methods_paragraph import methods
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.results.words import said_of_presentations
from study_app.analysis.tables.study_tables import Study
from tests.analysis.made_up import ITEMS, delays, everybody, liquids, study

pytestmark = pytest.mark.slow

LEVELS = (0.0, 50.0, 100.0, 150.0)


def rising(seed: int, shift: float = 0.0):  # type: ignore[no-untyped-def]
    """Return an answer that rises with the delay, by ``shift`` more in later sessions."""
    rng = np.random.default_rng(seed)

    def answer(_person: int, session: int, code: str, _item: str) -> int:
        return int(np.clip(round(int(code[1:]) + shift * (session - 1) + rng.normal()), 1, 7))

    return answer


def evaluated(made: Study) -> tuple[Results, BlockFound]:
    results = evaluate(made, planning=False)
    assert results.failures == ()
    return results, results.blocks[0]


def test_repetitions_are_said_and_single_answers_are_used_where_levels_count() -> None:
    made = study(delays(LEVELS), list(everybody(delays(LEVELS), 10, rising(1), repetitions=2)))
    results, found = evaluated(made)
    assert found.presentations == (2, 2)
    (line,) = said_of_presentations(found)
    assert "answered each statement 2 times for one delay" in line
    assert line in methods(made, results)
    assert line in " ".join(block(found, results, ()))
    (described,) = json.loads(codebook_bytes(made, {}))["blocks"]
    assert described["answers_per_participant_setting_and_item"] == [2, 2]
    assert THRESHOLD.of(found) is not None
    assert set(THRESHOLD.of(found).asked) == {20}
    for one in AGAIN.of(found).mixed:
        assert all(float(level).is_integer() for level in one.outcome.levels)  # type: ignore[attr-defined]


def test_sessions_are_shown_and_tested() -> None:
    made = study(delays(LEVELS), list(everybody(delays(LEVELS), 10, rising(1, shift=2.0), sessions=2)))
    results, found = evaluated(made)
    assert found.sessions == (1, 2)
    assert [one.verdict for one in SESSIONS.of(found)] == ["suggested", "suggested"]
    assert all("sessions as a factor" in one.outcome.method for one in AGAIN.of(found).mixed)
    assert len(AGAIN.of(found).mixed) == len(ITEMS)
    page = " ".join(block(found, results, ()))
    assert "The answers are of sessions 1 and 2, which are compared with each other" in page
    assert "Do sessions differ?" in page
    three = study(delays(LEVELS), list(everybody(delays(LEVELS), 10, rising(2), sessions=3)))
    _, found = evaluated(three)
    assert {one.outcome.test for one in SESSIONS.of(found)} == {"Friedman"}
    assert "suggested" not in {one.verdict for one in SESSIONS.of(found)}


def test_people_who_came_to_one_session_each_cannot_compare_them() -> None:
    trials = [one for one in everybody(delays(LEVELS), 8, rising(1), sessions=2) if (one[0] < "P004") == (one[1] == 1)]
    _, found = evaluated(study(delays(LEVELS), trials))
    assert SESSIONS.of(found) == ()
    assert any("no one answered the same setting in all of sessions" in one.why for one in found.absent)


def test_conditions_of_one_delay_are_replicates_of_it() -> None:
    twice = (0.0, 50.0, 50.0, 100.0, 150.0)
    results, found = evaluated(study(delays(twice), list(everybody(delays(twice), 12, rising(3)))))
    assert found.delays_ms == LEVELS
    assert found.replicated_ms == (50.0,)
    assert {one.delay_ms for one in CONTRASTS.of(found)} == {50.0, 100.0, 150.0}
    assert TREND.of(found)[0].outcome.p is not None
    assert THRESHOLD.of(found) is not None
    assert THRESHOLD.of(found).asked == (12, 24, 12, 12)
    assert "Several conditions present 50 ms: they are taken as repeated presentations" in " ".join(
        block(found, results, ())
    )


def test_of_two_settings_the_higher_one_is_named() -> None:
    two = liquids(2)
    made = study(two, list(everybody(two, 10, lambda person, _s, code, _i: 6 if code == "L2" else 1 + person % 3)))
    results, found = evaluated(made)
    page = " ".join(block(found, results, ()))
    assert "above 0 where Liquid1 was rated higher than Liquid2" in page
    assert ITEMS[0] == OMNIBUS.of(found)[0].item
