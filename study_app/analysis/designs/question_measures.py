"""The questions that no block of statements holds, measured; scores computed."""

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import pandas as pd

from study_app.analysis import measures
from study_app.analysis.measures.measure import Measure
from study_app.analysis.results.question_answers import GroupAnswers, QuestionFound, ScoreFound
from study_app.analysis.tables.asked_questions import AskedIn, AskedQuestion, AskedScore
from study_app.analysis.tables.compared_blocks import setting_name
from study_app.analysis.tables.study_tables import Study
from study_app.discovery import modules_of
from study_app.protocol.questionnaires import instrument, instruments, score

MEASURES: Final[dict[str, Measure]] = {
    module.MEASURE.id: module.MEASURE for module in modules_of(measures) if hasattr(module, "MEASURE")
}
"""Every measure by the id that a kind of question names it by, found by importing the modules of one folder."""

_ONE: Final = ["participant", "session", "trial"]


def questions_found(study: Study) -> tuple[QuestionFound, ...]:
    """Return the numbers of every question, in the order of the session."""
    return tuple(_question(study, asked) for asked in study.others.questions)


def scores_found(study: Study) -> tuple[ScoreFound, ...]:
    """Return every score, in the order of the session."""
    return tuple(_score(study, asked) for asked in study.others.scores)


def _question(study: Study, asked: AskedQuestion) -> QuestionFound:
    measure = MEASURES[asked.question.measure]
    return QuestionFound(
        where=asked.where.id,
        title=asked.where.title,
        is_form=asked.where.is_form,
        item=asked.id,
        text=asked.text,
        short=asked.short,
        kind=asked.question.kind_id,
        measure=measure.id,
        figure=asked.question.figure,
        groups=tuple(
            GroupAnswers(code, name, measure.of(asked, rows))
            for code, name, rows in _groups(asked.where, study.answers_to(asked))
        ),
    )


def _groups(where: AskedIn, answers: pd.DataFrame) -> Iterator[tuple[str | None, str, pd.DataFrame]]:
    """Yield the answers about each setting, or of a form all, with code and name."""
    if where.is_form:
        yield None, "All", answers
    for setting in where.settings:
        yield setting.code, setting_name(setting, where.settings), answers[answers["code"] == setting.code]


def scored(study: Study, asked: AskedScore) -> pd.DataFrame:
    """Return a row for every time that a questionnaire was answered: ``participant``, ``code`` and ``score``."""
    rows = pd.concat([study.answers_to(one) for one in asked.questions])
    bounds = {one.id: one.bounds for one in asked.questions}
    found: list[dict[str, Any]] = []
    for (participant, *_), answers in rows.groupby(_ONE, dropna=False, sort=True):
        answered = {
            str(item): str(response) if pd.isna(value) else float(value)
            for item, response, value in zip(answers["item"], answers["response"], answers["value"], strict=True)
            if not pd.isna(response)
        }
        code = None if asked.where.is_form else str(answers["code"].iloc[0])
        found.append({"participant": participant, "code": code, "score": score(asked.score, answered, bounds)})
    return pd.DataFrame(found, columns=["participant", "code", "score"])


def _score(study: Study, asked: AskedScore) -> ScoreFound:
    known = asked.instrument is not None and asked.instrument in instruments()
    return ScoreFound(
        where=asked.where.id,
        title=asked.where.title,
        name=asked.name,
        instrument=asked.instrument,
        source=str(instrument(asked.instrument)["source"]) if known and asked.instrument is not None else None,
        groups=tuple(
            GroupAnswers(code, name, _summary(rows["score"].dropna().to_numpy(dtype=float)))
            for code, name, rows in _groups(asked.where, scored(study, asked))
        ),
    )


def _summary(values: Any) -> dict[str, Any]:
    n = len(values)
    return {
        "n": n,
        "mean": float(values.mean()) if n else None,
        "sd": float(np.std(values, ddof=1)) if n > 1 else None,
        "smallest": float(values.min()) if n else None,
        "largest": float(values.max()) if n else None,
    }
