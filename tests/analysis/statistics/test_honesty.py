"""What every result keeps to, whatever the answers: no NaN, a reason for what is not there, and never "no effect"."""

import dataclasses
import math
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from study_app.analysis.statistics.equivalence.tost import tost
from study_app.analysis.statistics.friedman import friedman
from study_app.analysis.statistics.global_permutation import global_permutation
from study_app.analysis.statistics.ordinal import ordinal
from study_app.analysis.statistics.outcome import Outcome
from study_app.analysis.statistics.paired import paired
from study_app.analysis.statistics.psychometrics.threshold import noticed
from study_app.analysis.statistics.recognition import named, recognition
from study_app.analysis.statistics.skillings_mack import skillings_mack
from study_app.analysis.statistics.trend import page, step_down

RNG = np.random.default_rng(11)
ANSWERS = RNG.integers(1, 8, (12, 3)).astype(float)
GAPS = np.where(RNG.random((12, 3)) < 0.2, np.nan, ANSWERS)

TABLES = {
    "twelve people": ANSWERS,
    "five people": ANSWERS[:5],
    "one person": ANSWERS[:1],
    "nobody": ANSWERS[:0],
    "missing answers": GAPS,
    "all missing": np.full((3, 3), np.nan),
    "all equal": np.full((12, 3), 4.0),
    "equal within people": np.repeat(np.arange(1.0, 8.0), 3).reshape(7, 3),
    "all alike": np.tile([1.0, 4.0, 7.0], (12, 1)),
    "unused levels": np.where(ANSWERS > 4, 7.0, 6.0),
    "one answers": np.vstack([[1.0, np.nan, np.nan], np.full((2, 3), np.nan)]),
    "one setting missing": np.column_stack([ANSWERS[:, 0], np.full(12, np.nan), ANSWERS[:, 2]]),
}

TESTS: dict[str, Callable[[np.ndarray], Outcome]] = {
    "friedman": friedman,
    "global": lambda values: global_permutation(values[None]),
    "paired": lambda values: paired(values[:, 0], values[:, 2]),
    "page": page,
    "step down": lambda values: step_down(values, (0, 100, 200)).steps[0].page,
    "tost": lambda values: tost(values[:, 2] - values[:, 0], 1.0),
    "threshold": lambda values: noticed(values, (0, 100, 200)),
    "recognition": lambda values: recognition(named(np.stack([values, values[:, ::-1]], axis=1)), [0, 2], 3),
    "skillings-mack": skillings_mack,
    "ordinal": ordinal,
}


def numbers(value: object) -> Iterator[float]:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = [getattr(value, field.name) for field in dataclasses.fields(value)]
    if isinstance(value, list | tuple):
        for part in value:
            yield from numbers(part)
    elif isinstance(value, float):
        yield value


@pytest.mark.slow
@pytest.mark.parametrize("test", TESTS)
@pytest.mark.parametrize("table", TABLES)
def test_every_result_holds_what_it_promises(test: str, table: str) -> None:
    result = TESTS[test](TABLES[table])
    assert all(math.isfinite(number) for number in numbers(result))
    assert result.n + result.dropped == len(TABLES[table])
    assert (result.interval is None) == bool(result.no_interval)
    if result.p is None:
        assert result.note
    else:
        assert 0.0 <= result.p <= 1.0
        assert result.smallest_p is None or result.smallest_p <= result.p + 1e-12
    if result.interval is not None:
        assert result.interval.low <= result.interval.high
    said = " ".join(str(part) for part in dataclasses.astuple(result))
    assert "no effect" not in said


@pytest.mark.parametrize("test", TESTS)
def test_no_field_is_a_number_of_numpy(test: str) -> None:
    for name, value in dataclasses.asdict(TESTS[test](ANSWERS)).items():
        assert not isinstance(value, np.generic | np.ndarray), name


@pytest.mark.parametrize("test", ["friedman", "global", "page", "paired", "tost", "skillings-mack"])
def test_the_order_of_people_does_not_matter(test: str) -> None:
    there, back = TESTS[test](ANSWERS[:7]), TESTS[test](ANSWERS[:7][::-1])
    assert (there.statistic, there.effect) == pytest.approx((back.statistic, back.effect))
    assert there.p == pytest.approx(back.p, abs=0.02 if "Monte" in there.method else 1e-12)
