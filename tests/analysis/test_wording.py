"""The report's words follow what was decided and what was tested."""

from dataclasses import replace

import pytest

from study_app.analysis.evaluate import evaluate
from study_app.analysis.findings.contrast_with_control import FINDING as CONTRASTS
from study_app.analysis.report.findings_summary import findings
from study_app.analysis.report.methods_paragraph import methods
from study_app.analysis.report.r_script import r_script
from study_app.analysis.results.words import all_of
from study_app.analysis.tables.study_tables import Study
from tests.analysis.made_up import DECIDED, delays, everybody, liquids, study

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
    told = methods(made, evaluate(made, planning=False))
    assert "The decisions about the analysis changed between sessions" in told
    assert not any(f"{word} before the first session" in told.lower() for word in ("decided", "made"))
    assert "No decisions were made beforehand" not in told
    kept = study_of(8)
    told = methods(kept, evaluate(kept, planning=False))
    assert "a bound of ±1 point, decided before the first session, and 90 % intervals" in told


def test_pooled_versions_of_a_protocol_are_named() -> None:
    made = study_of(4)
    people = made.participants.assign(protocol_version=["1", "1", "2", "2"])
    both = replace(made, participants=people)
    assert "versions 1 and 2, pooled" in methods(both, evaluate(both, planning=False))


def test_the_verdict_of_unanimity_holds_after_the_correction() -> None:
    made = study_of(12)
    (found,) = evaluate(made, planning=False).blocks
    assert {one.verdict for one in CONTRASTS.of(found) if one.delay_ms > 0} == {"different"}
    assert all(one.found.interval is None for one in CONTRASTS.of(found))


@pytest.mark.parametrize(("longest_ms", "verdict"), [(50.0, "different"), (200.0, "inconclusive")])
def test_the_verdict_of_one_of_many_comparisons_is_the_corrected_one(longest_ms: float, verdict: str) -> None:
    by_chance, scattered = [2, 1, 1, 1, 1, 2, 1, -1, 1, 1], [3, -3, 2, -2, 0] * 2

    def answer(person: int, _session: int, code: str, _item: str) -> int:
        return 4 + {"D1": 0, "D2": by_chance[person]}.get(code, scattered[person])

    settings = delays([ms for ms in (0.0, 50.0, 100.0, 150.0, 200.0) if ms <= longest_ms])
    (found,) = evaluate(study(settings, list(everybody(settings, 10, answer))), planning=False).blocks
    assert CONTRASTS.of(found)[0].found.p_difference is not None
    assert CONTRASTS.of(found)[0].found.p_difference <= 0.05 / 2
    assert CONTRASTS.of(found)[0].verdict == verdict


def test_all_statements_are_told_as_a_reader_would() -> None:
    assert [all_of(count, "statement") for count in (1, 2, 3)] == [
        *("the one statement", "both statements", "all three statements")
    ]
    two = liquids(2)
    made = study(two, list(everybody(two, 10, moved)))
    told = " ".join(findings(evaluate(made, planning=False)))
    assert "one test over both statements" in told
    assert "“Different” (higher for Liquid2, adjusted p" in told


def test_the_script_compares_a_study_of_two_settings_and_counts() -> None:
    two = liquids(2)
    made = study(two, list(everybody(two, 10, moved)))
    script = r_script(made, evaluate(made, planning=False))
    assert script.count("\npair(") == 2
    assert "numbers compared" in script
    assert "if (compared == 0) quit(status = 1)" in script
    empty = study(two, [])
    assert "of 0 numbers compared" in r_script(empty, evaluate(empty, planning=False))
