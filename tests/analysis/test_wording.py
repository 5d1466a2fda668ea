"""The report's words follow what was decided and what was tested."""

import json
from dataclasses import replace

import numpy as np
import pytest

from study_app.analysis.data.study_tables import Study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.export.table_files import codebook_bytes
from study_app.analysis.findings.delays import ContrastsWithControl, DetectionThreshold
from study_app.analysis.findings.statement_tests import DelayTrend, MixedModel, SessionsDiffer
from study_app.analysis.report.sections import block, conduct, limits, methods
from study_app.analysis.results import BlockResult, Results, said_of_presentations
from tests.analysis.made_up import DECIDED, ITEMS, delays, everybody, study

pytestmark = pytest.mark.slow


LEVELS = (0.0, 50.0, 100.0)


def moved(person: int, _session: int, code: str, _item: str) -> int:
    return min(7, 1 + person % 3 + 2 * (int(code[1:]) - 1))


def study_of(people: int, *, changed: bool = False, alpha: float = 0.05, levels: tuple[float, ...] = LEVELS) -> Study:
    settings = delays(levels)
    decided = replace(DECIDED, changed=changed, alpha=alpha)
    return study(settings, list(everybody(settings, people, moved)), decided)


def test_decisions_that_changed_are_told_as_that_and_not_as_none() -> None:
    made = study_of(8, changed=True)
    told = methods(made, evaluate(made))
    assert "The decisions about the analysis changed between sessions" in told
    assert not any(f"{word} before the first session" in told.lower() for word in ("decided", "made"))
    assert "No decisions were made beforehand" not in told
    kept = study_of(8)
    told = methods(kept, evaluate(kept))
    assert "a bound of ±1 point, decided before the first session, and 90 % intervals" in told


def test_codes_of_participants_are_told_while_the_key_is_sealed() -> None:
    made = study_of(4)
    own = replace(made, settings={}, protocol={**made.protocol, "study": {"codes": "participant"}})
    said = "A code means another setting for each participant until the key is open: no settings are compared."
    assert [said in " ".join(limits(it, evaluate(it))) for it in (own, made)] == [True, False]


def test_trials_beyond_a_limit_are_counted_by_limit() -> None:
    made = study_of(4)
    gaps = [300.0, 300.0, *[1.0] * (len(made.trials) - 2)]
    broken = replace(
        made,
        trials=made.trials.assign(worst_frame_gap_ms=gaps),
        protocol={**made.protocol, "limits": {"frame_gap_ms": 250.0}},
    )
    told = " ".join(conduct(broken, evaluate(broken)))
    assert "frame gap at most 250 ms. 2 of 12 trials broke one: frame gap at most 250 ms in 2. Trials" in told


def test_pooled_versions_of_a_protocol_are_named() -> None:
    made = study_of(4)
    people = made.participants.assign(protocol_version=["1", "1", "2", "2"])
    both = replace(made, participants=people)
    assert "versions 1 and 2, pooled" in methods(both, evaluate(both))


def test_the_verdict_of_unanimity_holds_after_the_correction() -> None:
    made = study_of(12)
    (found,) = evaluate(made).blocks
    assert {one.verdict for one in DelayTrend.of(found)} == {"shown", "not shown"}  # rising, stated to fall
    assert all(one.found.interval is None for one in ContrastsWithControl.of(found))


FOUR_LEVELS = (0.0, 50.0, 100.0, 150.0)


def rising(seed: int, shift: float = 0.0):  # type: ignore[no-untyped-def]
    """Return an answer that rises with the delay, by ``shift`` more in later sessions."""
    rng = np.random.default_rng(seed)

    def answer(_person: int, session: int, code: str, _item: str) -> int:
        return int(np.clip(round(int(code[1:]) + shift * (session - 1) + rng.normal()), 1, 7))

    return answer


def evaluated(made: Study) -> tuple[Results, BlockResult]:
    results = evaluate(made)
    assert results.failures == ()
    return results, results.blocks[0]


def test_repetitions_are_said_and_single_answers_are_used_where_levels_count() -> None:
    made = study(delays(FOUR_LEVELS), list(everybody(delays(FOUR_LEVELS), 10, rising(1), repetitions=2)))
    results, found = evaluated(made)
    assert found.presentations == (2, 2)
    (line,) = said_of_presentations(found)
    assert "answered each statement 2 times for one delay" in line
    assert line in methods(made, results)
    assert line in " ".join(block(found, results, ()))
    (described,) = json.loads(codebook_bytes(made, {}))["blocks"]
    assert described["answers_per_participant_setting_and_item"] == [2, 2]
    assert DetectionThreshold.of(found) is not None
    assert set(DetectionThreshold.of(found).asked) == {20}


def test_sessions_are_shown_and_tested() -> None:
    made = study(delays(FOUR_LEVELS), list(everybody(delays(FOUR_LEVELS), 10, rising(1, shift=2.0), sessions=2)))
    results, found = evaluated(made)
    assert found.sessions == (1, 2)
    assert [one.verdict for one in SessionsDiffer.of(found)] == ["suggested", "suggested"]
    assert len(MixedModel.of(found)) == len(ITEMS)
    page = " ".join(block(found, results, ()))
    assert "The answers are of sessions 1 and 2, which are compared with each other" in page
    assert "Do sessions differ?" in page
    three = study(delays(FOUR_LEVELS), list(everybody(delays(FOUR_LEVELS), 10, rising(2), sessions=3)))
    _, found = evaluated(three)
    assert {one.outcome.test for one in SessionsDiffer.of(found)} == {"Friedman"}
    assert "suggested" not in {one.verdict for one in SessionsDiffer.of(found)}


def test_conditions_of_one_delay_are_replicates_of_it() -> None:
    twice = (0.0, 50.0, 50.0, 100.0, 150.0)
    results, found = evaluated(study(delays(twice), list(everybody(delays(twice), 12, rising(3)))))
    assert found.delays_ms == FOUR_LEVELS
    assert found.replicated_ms == (50.0,)
    assert {one.delay_ms for one in ContrastsWithControl.of(found)} == {50.0, 100.0, 150.0}
    assert DelayTrend.of(found)[0].outcome.p is not None
    assert DetectionThreshold.of(found) is not None
    assert DetectionThreshold.of(found).asked == (12, 24, 12, 12)
    assert "Several conditions present 50 ms: they are taken as repeated presentations" in " ".join(
        block(found, results, ())
    )
