"""Texts: each of them, in the order of the participants."""

from typing import Final

import pandas as pd

from study_app.analysis.measures.measure import Measure, Numbers, counts_of_missing, given
from study_app.analysis.tables.asked_questions import AskedQuestion


def _of(_asked: AskedQuestion, answers: pd.DataFrame) -> Numbers:
    texts = given(answers).sort_values(["participant", "session"], kind="stable")
    pairs = zip(texts["participant"], texts["response"], strict=True)
    return {**counts_of_missing(answers), "texts": [f"{person}: {text}" for person, text in pairs]}


MEASURE: Final = Measure("texts", _of, None)
