"""Answers that differ by condition, and the sentence with which results are refused."""

from pathlib import Path

import pytest

from study_app.analysis.data.study_tables import load_study
from study_app.errors import AnalysisError
from tests.analysis.conftest import Answer


def by_condition(condition: str, item: str) -> Answer:
    return {"water": 2, "honey": 5, "light_oil": 7}.get(condition, 4)


def refusal(folder: Path) -> str:
    with pytest.raises(AnalysisError) as error:
        load_study(folder)
    return str(error.value)
