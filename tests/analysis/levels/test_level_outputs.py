"""What the report and the exported tables take from each statistic of a block of levels."""

import re
from collections.abc import Mapping
from typing import Any

import pytest

from study_app.analysis.levels.exponents import ExponentEstimate, Exponents
from study_app.analysis.levels.sensitivities import Sensitivities, SensitivityEstimate
from study_app.analysis.levels.statistic import LevelStatistic
from study_app.analysis.levels.thresholds import ThresholdEstimate, Thresholds
from study_app.analysis.results import LevelsResult
from study_app.protocol.model import Published

PUBLISHED = (
    Published(block="b", measure="weber", value=0.19, source="Jones 1997"),
    Published(block="b", measure="exponent", value=0.42, source="Stevens 1957"),
)
STATISTICS = {
    "thresholds": (
        ThresholdEstimate(
            participant="P001", standard=8.0, n=61, threshold=0.311, low=0.252, high=0.403, width=0.71,
            flat_width=0.322, fit_p=0.47,
        ),
        ThresholdEstimate(participant="P002", standard=8.0, n=62, threshold=0.184, low=0.133, high=0.291),
    ),
    "exponents": (
        ExponentEstimate(participant="P001", n=4, exponent=0.83),
        ExponentEstimate(participant="P002", n=3, exponent=0.91),
    ),
    "sensitivities": (
        SensitivityEstimate(
            participant="P001", n=61, shares={"first": 0.57}, standard=8.0, d_prime=1.31, low=1.02, high=1.64
        ),
        SensitivityEstimate(
            participant="P002", n=62, shares={"first": 0.44}, standard=8.0, d_prime=0.77, low=0.51, high=1.12
        ),
        SensitivityEstimate(
            participant="P002", n=20, shares={"first": 0.36}, standard=8.0, comparison="L2", d_prime=0.23
        ),
        SensitivityEstimate(participant="P002", n=21, shares={"first": 0.35}, standard=8.0, level=0.2, d_prime=0.24),
    ),
}  # fmt: skip


def result(statistics: Mapping[str, Any] = STATISTICS) -> LevelsResult:
    """Return the results of a block."""
    return LevelsResult(
        block="b",
        title="B",
        design="2ifc",
        revealed=True,
        times=(),
        summary="share",
        counts="correct",
        level_kind="weber",
        quantity="damping",
        family="weibull",
        statistics=statistics,
        published=PUBLISHED,
    )


@pytest.mark.parametrize(
    ("statistic", "source"),
    [(Thresholds, "Jones 1997: Weber fraction 0.19"), (Exponents, "Stevens 1957: exponent 0.42")],
)
def test_a_table_quotes_the_published_values_of_its_own_measure(
    statistic: type[LevelStatistic[Any]], source: str
) -> None:
    quoted = re.findall(r"Published: (.*?)\.</p>", "".join(statistic(result()).section()))
    assert quoted == [source]


def test_exported_thresholds_have_all_estimates_of_a_participant() -> None:
    """Ratings at a level are not exported; a compared condition has its own row, without the threshold."""
    first, second, compared = Sensitivities(result()).export_rows()
    assert first.items() >= {
        "participant": "P001", "block": "b", "standard": 8.0, "n": 61, "threshold": 0.311, "low": 0.252, "high": 0.403,
        "width": 0.71, "flat_width_threshold": 0.322, "fit_p": 0.47, "weber_exponent": 0.83, "d_prime": 1.31,
        "share_first": 0.57, "condition": None,
    }.items()  # fmt: skip
    assert second.items() >= {
        "participant": "P002", "n": 62, "threshold": 0.184, "low": 0.133, "high": 0.291, "weber_exponent": 0.91,
        "d_prime": 0.77, "share_first": 0.44, "condition": None,
    }.items()  # fmt: skip
    assert compared.items() >= {"participant": "P002", "n": 20, "d_prime": 0.23, "condition": "L2"}.items()
    assert [compared.get(name) for name in ("threshold", "low", "high", "weber_exponent")] == [None] * 4
