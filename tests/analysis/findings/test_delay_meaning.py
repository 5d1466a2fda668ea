"""What is said of a delay: never more than every delay up to it allows, and equivalent only where all checks agree."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import pytest

from study_app.analysis.data.blocks import NOTHING_DECIDED, Direction, Item, Setting
from study_app.analysis.data.study_tables import load_study
from study_app.analysis.findings.delays import ContrastsWithControl, ContrastWithControl, Lowest, LowestDelay, by_delay
from study_app.analysis.findings.finding import MANY
from study_app.analysis.findings.mixed_models import MixedModel
from study_app.analysis.report.sections import limits
from study_app.analysis.results import BlockResult
from study_app.analysis.results import Results as Found
from study_app.analysis.statistics.equivalence import tost
from study_app.analysis.statistics.outcome import FEW, holm
from study_app.analysis.statistics.trend import step_down
from tests.analysis.conftest import Results

CALM = [1, 1, 0, 0, -1] * 6
AWAY = [3, 4, 3, 4, 3] * 6
SCATTERED = [3, -3, 2, -2, 0]
DOUBTED = [5] + [0] * 14
"""By t equivalent (p = .033) within a point; by the bootstrap-t not."""


def against(differences: Mapping[float, list[int]], expected: Direction | None) -> tuple[ContrastWithControl, ...]:
    each = [tost(values, 1.0) for values in differences.values()]
    adjusted = holm([one.p_difference for one in each])
    return tuple(
        ContrastWithControl("different", ms, 0.0, one.judged(p, len(each)), p, len(each), expected)
        for ms, one, p in zip(differences, each, adjusted, strict=True)
    )


def delays(
    differences: Mapping[float, list[int]], lowest: tuple[Lowest, ...] = (), expected: Direction | None = "increasing"
) -> BlockResult:
    """Return a block of delays in which answers to one statement differ so from those at 0 ms."""
    at = (0.0, *differences)
    return BlockResult(
        id="delays",
        title="Delays",
        kind="delays",
        revealed=True,
        n=len(next(iter(differences.values()))),
        settings=tuple(Setting(f"D{place}", f"delay_{ms:g}", "water", ms) for place, ms in enumerate(at)),
        names=tuple(f"{ms:g} ms" for ms in at),
        items=(Item("different", "It was different.", "Different"),),
        labels=tuple("1234567"),
        measures=(),
        findings={ContrastsWithControl.key: against(differences, expected), LowestDelay.key: lowest},
    )


def found(block: BlockResult) -> Found:
    return Found(NOTHING_DECIDED, (), (block,), (), {}, None, 1)


AGAINST = "speak against “delays up to 50 ms do not matter”"
UNCLEAR = "neither support nor refute “delays up to 50 ms do not matter”"
WITHIN = "Mean answers to these statements stay within the bound"


@pytest.mark.parametrize(
    ("differences", "expected", "said"),
    [
        (CALM, "increasing", WITHIN),
        (SCATTERED, "increasing", UNCLEAR),
        (AWAY, "increasing", AGAINST),
        ([-one for one in AWAY], "increasing", "by −3.40, against the direction stated before the study."),
        ([-one for one in AWAY], None, "“Different” differs at 50 ms by −3.40."),
        ([-one for one in AWAY], "decreasing", "“Different” differs at 50 ms by −3.40."),
        ([0] * 5, "increasing", UNCLEAR),
        ([2] * 5, "increasing", UNCLEAR),
        ([0, 1, 0, -1] * 3, "increasing", UNCLEAR),
    ],
)
def test_the_sentence_about_one_delay_follows_verdict_and_direction(
    differences: list[int], expected: Direction | None, said: str
) -> None:
    assert said in by_delay(delays({50: differences}, expected=expected))[0][-1]


def test_a_difference_at_a_shorter_delay_speaks_against_the_longer_one() -> None:
    (*verdicts, told) = by_delay(delays({50: AWAY, 100: SCATTERED * 2}))[1]
    assert verdicts == ["100 ms", "–", "–", "Different", "–"]
    assert "speak against “delays up to 100 ms do not matter”: “Different” differs at 50 ms by 3.40." in told


def test_a_trend_that_shows_only_within_its_statement_speaks_against_nothing() -> None:
    steps = step_down([[1, 3, 5], [1, 3, 5], [1, 3, 5], [3, 1, 5], [1, 3, 5]], [0, 50, 100], alpha=0.2)
    alone, of_five = Lowest("different", steps), Lowest("different", steps, members=5)
    assert alone.over_all_ms == steps.lowest_ms == 50
    assert of_five.over_all_ms == 100  # the second step has p = .19, the first .0003
    assert "speak against" in by_delay(delays({50: SCATTERED}, (alone,)))[0][-1]
    assert "speak against" not in by_delay(delays({50: SCATTERED}, (of_five,)))[0][-1]


def test_one_of_many_comparisons_that_differs_by_chance_speaks_against_nothing() -> None:
    chance = [2, 1, 1, 1, 1, 2, 1, -1, 1, 0]
    alone = delays({50: chance})
    assert ContrastsWithControl.of(alone)[0].verdict == "different"
    many = delays({50: chance, **{float(ms): SCATTERED * 2 for ms in range(75, 201, 25)}})
    assert ContrastsWithControl.of(many)[0].verdict == "inconclusive"
    assert "speak against" not in by_delay(many)[0][-1]


def test_five_people_cannot_make_a_single_comparison_different_by_taking_them_as_normal() -> None:
    certain = delays({50: [3, 4, 3, 4, 4]})
    assert ContrastsWithControl.of(certain)[0].found.p_different is not None
    assert ContrastsWithControl.of(certain)[0].found.p_different < 0.001
    assert ContrastsWithControl.of(certain)[0].p_adjusted == 0.0625
    assert ContrastsWithControl.of(certain)[0].verdict == "out of reach"


def test_what_only_t_calls_equivalent_is_told_as_inconclusive(rek: Results) -> None:
    block = delays({50: DOUBTED})
    assert ContrastsWithControl.of(block)[0].found.p is not None
    assert ContrastsWithControl.of(block)[0].found.p < 0.05
    assert ContrastsWithControl.of(block)[0].found.checks_agree is False
    ((*told, said),) = by_delay(block)
    assert told == ["50 ms", "–", "–", "Different", "–"]
    assert UNCLEAR in said
    rek.add("P001", lambda *_: 4)
    assert any(
        "inconclusive or out of reach: 1 of 1 comparisons" in line
        for line in limits(load_study(rek.folder), found(block))
    )


def test_every_delay_has_its_own_sentence() -> None:
    rows = by_delay(delays({50: CALM, 125: SCATTERED, 300: AWAY}))
    assert rows[0][-1].startswith(WITHIN)
    assert "neither support nor refute “delays up to 125 ms do not matter”" in rows[1][-1]
    assert "speak against “delays up to 300 ms do not matter”: “Different” differs at 300 ms" in rows[2][-1]


@pytest.mark.parametrize(
    ("k", "sites", "revealed", "n", "reason"),
    [
        (1, (), True, 20, "there is one setting"),
        (2, ("A", "B"), False, 20, "each site has settings of its own until the keys of all sites are open"),
        (2, (), True, FEW - 1, f"with {FEW - 1} participants, below {FEW}, its estimates and errors would not hold"),
        (2, (), True, MANY + 1, f"it is left out above {MANY} participants, where it takes minutes"),
        (2, ("A", "B"), True, FEW, ""),
        (2, (), False, MANY, ""),
    ],
)
def test_the_mixed_model_is_left_out_for_a_reason(
    k: int, sites: tuple[str, ...], revealed: bool, n: int, reason: str
) -> None:
    block = SimpleNamespace(id="b", kind="liquids", revealed=revealed)
    asked: Any = SimpleNamespace(k=k, sites=sites, n=n, block=block, single={}, verdicts_only=False)
    _, absent = MixedModel.test(asked, found(delays({50: CALM})))
    assert [(one.what, one.why) for one in absent] == ([("mixed model of the settings", reason)] if reason else [])
