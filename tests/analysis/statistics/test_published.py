"""Published examples of every statistic: the numbers that their sources print."""

import tomllib
from importlib import import_module
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from study_app.analysis.statistics.equivalence import tost
from study_app.analysis.statistics.rank_tests import friedman, signed_rank_test

PUBLISHED = tomllib.loads(Path(__file__).with_name("published.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("case", PUBLISHED["case"], ids=lambda case: f"{case['function']} {str(case['given'])[:30]}")
def test_published_result(case: dict[str, Any]) -> None:
    module, name = case["function"].split(".")
    function = getattr(import_module(f"study_app.analysis.statistics.{module}"), name)
    result = function(
        *(PUBLISHED["tables"][argument] if isinstance(argument, str) else argument for argument in case["given"])
    )
    for part, expected in case["expected"].items():
        value = attrgetter(part)(result) if part else result
        assert value == (expected if isinstance(expected, str) else pytest.approx(expected, rel=case.get("rel", 1e-9)))


SMALLEST = {
    "friedman": {4: 0.00463, 5: 0.000772, 6: 0.000129, 7: 2.1e-5, 8: 3.6e-6, 10: 9.9e-8, 11: 1.7e-8},
    "paired": {4: 0.125, 5: 0.0625, 6: 0.03125, 7: 0.015625, 8: 0.0078125, 10: 0.001953125, 11: 0.0009765625},
}


@pytest.mark.parametrize(("test", "n"), [(test, n) for test, smallest in SMALLEST.items() for n in smallest])
def test_the_smallest_p_of_so_many_people_who_agree(test: str, n: int) -> None:
    result = friedman([[1, 4, 7]] * n) if test == "friedman" else signed_rank_test(np.arange(n) + 2.0, np.ones(n))
    assert result.smallest_p == pytest.approx(SMALLEST[test][n], rel=0.03)
    assert result.p == result.smallest_p
    assert result.effect == pytest.approx(1.0)
    assert ("cannot reach p ≤ 0.05" in result.note) == (result.smallest_p > 0.05)


@pytest.mark.parametrize(
    ("differences", "verdict"),
    [
        ([2.0] * 17, "not equivalent"),
        ([0.0] * 17, "equivalent"),
        ([1.0] * 17, "inconclusive"),  # on the bound: not within it
        ([0.0] * 16, "out of reach"),
        ([2.0] * 12, "not equivalent"),
        ([2.0] * 5, "not equivalent"),  # 2**-5 < 0.05
        ([2.0] * 4, "out of reach"),
        ([-2.0, -3.0] * 5, "not equivalent"),
        ([1.0, 2.0, 3.0, 2.0] * 5, "not equivalent"),
        ([1.0, 2.0, 0.0, 2.0] * 5, "inconclusive"),
        ([0.0, 1.0, 0.0, -1.0] * 4, "out of reach"),
        ([0.0, 1.0, 0.0, -1.0] * 4 + [0.0], "equivalent"),  # of one in six some are in it: (5 / 6)**17 < 0.05
    ],
)
def test_equivalence_needs_enough_people_or_equal_differences(differences: list[float], verdict: str) -> None:
    assert tost(differences, 1.0).verdict == verdict
