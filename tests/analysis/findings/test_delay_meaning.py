"""What is said of a delay: never more than every delay up to it allows, and equivalent only where all checks agree."""

from collections.abc import Mapping

import numpy as np
import pytest

from study_app.analysis.data.blocks import NOTHING_DECIDED, Item, Setting
from study_app.analysis.data.study_tables import load_study
from study_app.analysis.findings.delays import (
    ContrastsWithControl,
    ContrastWithControl,
    LowestDelay,
    LowestTrend,
    rows_by_delay,
)
from study_app.analysis.report.sections import limits
from study_app.analysis.results import BlockResult
from study_app.analysis.results import Results as Found
from study_app.analysis.statistics.equivalence import tost
from study_app.analysis.statistics.trend_tests import step_down
from tests.analysis.conftest import Results

CALM = [1, 1, 0, 0, -1] * 6
AWAY = [3, 4, 3, 4, 3] * 6
SCATTERED = [3, -3, 2, -2, 0]
DOUBTED = [5] + [0] * 16
"""By t equivalent (p = .033) within a point; by the bootstrap-t not."""


def against(differences: Mapping[float, list[int]]) -> tuple[ContrastWithControl, ...]:
    return tuple(ContrastWithControl("different", ms, 0.0, tost(values, 1.0)) for ms, values in differences.items())


def delays(differences: Mapping[float, list[int]], lowest: tuple[LowestTrend, ...] = ()) -> BlockResult:
    """Return a block of delays with these differences from 0 ms in one statement."""
    at = (0.0, *differences)
    return BlockResult(
        id="delays",
        title="Delays",
        kind="delays",
        revealed=True,
        n=len(next(iter(differences.values()))),
        settings=tuple(
            Setting(code=f"D{place}", condition=f"delay_{ms:g}", liquid="water", delay_ms=ms)
            for place, ms in enumerate(at)
        ),
        names=tuple(f"{ms:g} ms" for ms in at),
        items=(Item(id="different", text="It was different.", short="Different"),),
        labels=tuple("1234567"),
        measures=(),
        findings={ContrastsWithControl.key: against(differences), LowestDelay.key: lowest},
    )


def results_of_block(block: BlockResult) -> Found:
    return Found(NOTHING_DECIDED, (), (block,), (), {}, None, 1)


UNCLEAR = "neither support nor refute the claim that delays of up to 50 ms do not matter"
BEYOND = (
    "Delays of up to 50 ms change the answers: mean answers differ from those at the shortest delay by more than the "
    "bound for “Different” (at 50 ms)."
)
WITHIN = "The mean answers to these statements stay within the bounds"


@pytest.mark.parametrize(
    ("differences", "said"),
    [(CALM, WITHIN), (SCATTERED, UNCLEAR), (AWAY, BEYOND), ([0] * 5, UNCLEAR), ([2] * 5, BEYOND), ([2] * 12, BEYOND)],
)
def test_the_sentence_about_one_delay_follows_the_verdict(differences: list[int], said: str) -> None:
    assert said in rows_by_delay(delays({50: differences}))[0][-1]


def test_a_trend_within_one_statement_does_not_contradict_equivalence() -> None:
    steps = step_down([[1, 3, 5], [1, 3, 5], [1, 3, 5], [3, 1, 5], [1, 3, 5]], [0, 50, 100], alpha=0.2)
    alone, of_five = LowestTrend("different", steps), LowestTrend("different", steps, members=5)
    assert alone.over_all_ms == steps.lowest_ms == 50
    assert of_five.over_all_ms == 100  # the second step has p = .19, the first .0003
    inconclusive = (
        "Delays of up to 50 ms change the answers: agreement with “Different” shows a trend over delays of up to 50 ms."
        " For “Different”, the data do not show whether the mean difference at 50 ms exceeds the bound."
    )
    assert rows_by_delay(delays({50: SCATTERED}, (alone,)))[0][-1] == inconclusive
    assert "change the answers" not in rows_by_delay(delays({50: SCATTERED}, (of_five,)))[0][-1]


NEITHER = "(one for each statement and delay), the data show neither that the mean answer stays within ±1 point nor"


def test_equivalence_by_the_t_test_alone_is_reported_as_inconclusive(rek: Results) -> None:
    block = delays({50: DOUBTED})
    assert ContrastsWithControl.value_in(block)[0].found.p is not None
    assert ContrastsWithControl.value_in(block)[0].found.p < 0.05
    assert ContrastsWithControl.value_in(block)[0].found.checks_agree is False
    ((*other_rows, conclusion),) = rows_by_delay(block)
    assert other_rows == ["50 ms", "–", "–", "Different", "–"]
    assert UNCLEAR in conclusion
    rek.add("P001", lambda *_: 4)
    assert any(
        f"in 1 of 1 comparison with 0 ms {NEITHER}" in line
        for line in limits(load_study(rek.folder), results_of_block(block))
    )


def test_limits_do_not_call_an_interval_beyond_the_bound_inconclusive(rek: Results) -> None:
    rek.add("P001", lambda *_: 4)
    lines = limits(load_study(rek.folder), results_of_block(delays({50: DOUBTED, 150: [2] * 17})))
    assert any(f"in 1 of 2 comparisons with 0 ms {NEITHER}" in line for line in lines)
    assert not any(NEITHER in line for line in limits(load_study(rek.folder), results_of_block(delays({150: AWAY}))))
    (row,) = rows_by_delay(delays({150: AWAY}))
    assert row[:-1] == ["150 ms", "–", "Different", "–", "–"]


def test_every_delay_has_its_own_sentence() -> None:
    steps = step_down(np.tile([1, 2, 2, 5], (12, 1)), [0, 50, 125, 300])
    rows = rows_by_delay(delays({50: CALM, 125: SCATTERED, 300: AWAY}, (LowestTrend("different", steps),)))
    assert rows[0][-1].startswith(WITHIN)
    assert rows[2][-1].startswith("Delays of up to 300 ms change the answers: agreement with “Different” shows a trend")
