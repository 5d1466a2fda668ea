"""The words of the report of small and unusual studies made up in memory, compared with reviewed files."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.analysis.outputs import GOLDEN, report_words
from tests.analysis.random_studies import drawn
from tests.golden import CHANGING, compare, each_once

STUDIES = [16, *(pytest.param(number, marks=pytest.mark.slow) for number in (0, 12, 19))]
"""Numbers of studies that together reach what those of twenty others do."""
RECORDED = (0, 12)


@pytest.mark.parametrize("number", STUDIES)
def test_the_report_of_a_random_study(number: int, tmp_path: Path, pytestconfig: pytest.Config) -> None:
    random_study = replace(drawn(np.random.default_rng(number)), folder=tmp_path)
    words = list(report_words(random_study))
    assert not [line for line in words if re.search(r"\b(nan|None|inf)\b|[{}]", line)]
    if number in RECORDED:
        compare(GOLDEN / f"random-{number}.txt", each_once(words), pytestconfig, mask=CHANGING)
