"""Choices: how often each option was chosen."""

from typing import Final

import pandas as pd

from study_app.analysis.measures.measure import Measure, Numbers, counts_of_missing, given
from study_app.analysis.tables.asked_questions import AskedQuestion


def _of(asked: AskedQuestion, answers: pd.DataFrame) -> Numbers:
    chosen = [asked.question.counted(str(response)) for response in given(answers)["response"]]
    return {
        **counts_of_missing(answers),
        "counts": {option: sum(option in one for one in chosen) for option in asked.levels},
    }


def _cells(asked: AskedQuestion, numbers: Numbers) -> dict[str, str]:
    total = numbers["n"] or 1
    return {
        **{
            words: f"{(count := numbers['counts'][option])} ({100 * count / total:.0f} %)"
            for option, words in asked.levels.items()
        },
        "n": str(numbers["n"]),
        "missing": str(numbers["missing"]),
    }


MEASURE: Final = Measure("counts", _of, _cells)
