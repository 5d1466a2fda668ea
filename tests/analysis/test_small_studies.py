"""The whole report of small and unusual studies made up in memory, compared with reviewed files."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.analysis.outputs import GOLDEN, report_lines
from tests.analysis.random_studies import drawn
from tests.golden import CHANGING, compare

STUDIES = [16, *(pytest.param(number, marks=pytest.mark.slow) for number in (0, 12, 19))]
"""Numbers of studies that together reach what those of twenty others do."""


@pytest.mark.parametrize("number", STUDIES)
def test_the_report_of_a_random_study(number: int, tmp_path: Path, pytestconfig: pytest.Config) -> None:
    made = replace(drawn(np.random.default_rng(number)), folder=tmp_path)
    compare(GOLDEN / f"random-{number}.txt", report_lines(made), pytestconfig, mask=CHANGING)
