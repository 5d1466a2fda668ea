"""Questions other than statements after trials: measures of their answers, and scores of questionnaires."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
import pandas as pd

from study_app.analysis.data.blocks import PlacedQuestion, PlacedScore, QuestionPlace
from study_app.analysis.data.measures import quartiles_or_none
from study_app.analysis.data.study_tables import Study, groups_shown
from study_app.analysis.results import GroupAnswers, QuestionResult, ScoreResult
from study_app.analysis.wording import number, with_group
from study_app.discovery import by_name
from study_app.protocol.questionnaires import Instrument

Numbers: TypeAlias = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Measure:
    """A measure of the answers to a question.

    ``of`` computes the numbers of a group of answers by name, from rows with ``response``, ``value`` and
    ``cannot_judge``. ``cells`` returns the cells of a table row by heading; a measure without cells lists its
    ``texts``.
    """

    id: str
    of: Callable[[PlacedQuestion, pd.DataFrame], Numbers]
    cells: Callable[[PlacedQuestion, Numbers], Mapping[str, str]] | None


def given_answers(answers: pd.DataFrame) -> pd.DataFrame:
    """Return the answers on the scale, without missing ones."""
    return answers[answers["response"].notna()]


def counts_of_missing(answers: pd.DataFrame) -> dict[str, Any]:
    """Return the numbers of answers, participants, missing answers, and answers off the scale."""
    valid = given_answers(answers)
    cannot_judge = int(answers["cannot_judge"].sum())
    return {
        "n": len(valid),
        "participants": int(valid["participant"].nunique()),
        "cannot_judge": cannot_judge,
        "missing": len(answers) - len(valid) - cannot_judge,
    }


def _quartile_cells(numbers: Numbers) -> dict[str, str]:
    """Return median and quartiles as cells."""
    low, high = numbers["q1"], numbers["q3"]
    return {
        "median": number(numbers["median"], 1),
        "quartiles": "–" if low is None else f"{number(low, 1)} – {number(high, 1)}",
    }


def _distribution(_question: PlacedQuestion, answers: pd.DataFrame) -> Numbers:
    values = given_answers(answers)["value"].to_numpy(dtype=float)
    return {
        **counts_of_missing(answers),
        **quartiles_or_none(values)._asdict(),
        "smallest": float(values.min()) if len(values) else None,
        "largest": float(values.max()) if len(values) else None,
        "values": sorted(float(value) for value in values),
    }


def _distribution_cells(_question: PlacedQuestion, numbers: Numbers) -> dict[str, str]:
    minimum, maximum = numbers["smallest"], numbers["largest"]
    return {
        "n": str(numbers["n"]),
        "missing": str(numbers["missing"]),
        **_quartile_cells(numbers),
        "range": "–" if minimum is None else f"{number(minimum, 1)} – {number(maximum, 1)}",
    }


_DISTRIBUTION: Final = Measure("distribution", _distribution, _distribution_cells)


def _option_counts(question: PlacedQuestion, answers: pd.DataFrame) -> Numbers:
    chosen = [question.question.counted(str(response)) for response in given_answers(answers)["response"]]
    return {
        **counts_of_missing(answers),
        "counts": {option: sum(option in answer for answer in chosen) for option in question.levels},
    }


def _option_cells(question: PlacedQuestion, numbers: Numbers) -> dict[str, str]:
    total = numbers["n"] or 1
    return {
        **{
            text: f"{(count := numbers['counts'][option])} ({100 * count / total:.0f} %)"
            for option, text in question.levels.items()
        },
        "n": str(numbers["n"]),
        "missing": str(numbers["missing"]),
    }


_OPTION_COUNTS: Final = Measure("counts", _option_counts, _option_cells)


def _point_counts(question: PlacedQuestion, answers: pd.DataFrame) -> Numbers:
    chosen = given_answers(answers)["response"].value_counts()
    return {
        **counts_of_missing(answers),
        "counts": {point: int(chosen.get(point, 0)) for point in question.levels},
        **quartiles_or_none(given_answers(answers)["value"].to_numpy(dtype=float))._asdict(),
    }


def _point_cells(_question: PlacedQuestion, numbers: Numbers) -> dict[str, str]:
    return {
        **{point: str(count) for point, count in numbers["counts"].items()},
        "n": str(numbers["n"]),
        "missing": str(numbers["missing"] + numbers["cannot_judge"]),
        **_quartile_cells(numbers),
    }


_POINT_COUNTS: Final = Measure("rating", _point_counts, _point_cells)


def _listed_texts(_question: PlacedQuestion, answers: pd.DataFrame) -> Numbers:
    texts = given_answers(answers).sort_values(["participant", "session"], kind="stable")
    pairs = zip(texts["participant"], texts["response"], strict=True)
    return {**counts_of_missing(answers), "texts": [f"{person}: {text}" for person, text in pairs]}


_TEXTS: Final = Measure("texts", _listed_texts, None)


MEASURES: Final = {measure.id: measure for measure in (_POINT_COUNTS, _OPTION_COUNTS, _DISTRIBUTION, _TEXTS)}
"""All measures by the ID with which a kind of question selects one."""

_QUESTIONNAIRE_COLUMNS: Final = ["participant", "session", "trial"]


def question_results(study: Study) -> tuple[QuestionResult, ...]:
    """Return the numbers of every question in session order."""
    return tuple(_question_result(study, question) for question in study.others.questions)


def score_results(study: Study) -> tuple[ScoreResult, ...]:
    """Return every score in session order."""
    return tuple(_score_result(study, score) for score in study.others.scores)


def _question_result(study: Study, question: PlacedQuestion) -> QuestionResult:
    measure, parts = by_name(MEASURES, question.question.measure), groups_shown(study)
    return QuestionResult(
        where=question.where.id,
        title=question.where.title,
        is_form=question.where.is_form,
        item=question.id,
        text=question.text,
        short=question.short,
        kind=question.question.kind_id,
        measure=measure.id,
        figure=question.question.figure,
        groups=tuple(
            GroupAnswers(code, group if group and code is None else with_group(name, group), measure.of(question, rows))
            for of_groups in zip(
                *(_answers_by_setting(question.where, part.answers_to(question)) for _, part in parts), strict=True
            )
            for (group, _), (code, name, rows) in zip(parts, of_groups, strict=True)
        ),
        options=question.levels,
        weighs=any(
            question.id in score.score.weights_from
            for score in study.others.scores
            if score.where.id == question.where.id
        ),
    )


def _answers_by_setting(where: QuestionPlace, answers: pd.DataFrame) -> Iterator[tuple[str | None, str, pd.DataFrame]]:
    """Yield the answers about each setting with code and name, or all answers in a form that is asked once."""
    if not where.settings:
        yield None, "All", answers
    for setting in where.settings:
        yield setting.code, where.name(setting), answers[answers["code"] == setting.code]


def scored(study: Study, placed_score: PlacedScore) -> pd.DataFrame:
    """Return one row per completed questionnaire: ``participant``, ``code``, ``after_block`` and ``score``."""
    rows = pd.concat([study.answers_to(question) for question in placed_score.questions])
    bounds = {question.id: question.bounds for question in placed_score.questions}
    scores: list[dict[str, Any]] = []
    columns = _QUESTIONNAIRE_COLUMNS if not placed_score.where.is_form else [*_QUESTIONNAIRE_COLUMNS, "code"]
    for (participant, *_), answers in rows.groupby(columns, dropna=False, sort=True):
        answered = {
            str(item): str(response) if pd.isna(value) else float(value)
            for item, response, value in zip(answers["item"], answers["response"], answers["value"], strict=True)
            if not pd.isna(response)
        }
        code = str(answers["code"].iloc[0]) if placed_score.where.settings else None
        score = placed_score.score.compute(answered, bounds)
        after_block = answers["after_block"].iloc[0]
        scores.append({"participant": participant, "code": code, "after_block": after_block, "score": score})
    return pd.DataFrame(scores, columns=["participant", "code", "after_block", "score"])


def _score_result(study: Study, score: PlacedScore) -> ScoreResult:
    known = score.instrument is not None and score.instrument in Instrument.names()
    return ScoreResult(
        where=score.where.id,
        title=score.where.title,
        name=score.name,
        instrument=score.instrument,
        source=str(Instrument(score.instrument).table["source"]) if known and score.instrument is not None else None,
        groups=tuple(
            GroupAnswers(code, name, _score_summary(rows.dropna(subset=["score"])))
            for code, name, rows in _answers_by_setting(score.where, scored(study, score))
        ),
    )


def _score_summary(scores: pd.DataFrame) -> dict[str, Any]:
    """Return the numbers of scores, each participant's scores being averaged first."""
    values = scores.astype({"score": float}).groupby("participant")["score"].mean().to_numpy()
    n = len(values)
    return {
        "n": n,
        "mean": float(values.mean()) if n else None,
        "sd": float(np.std(values, ddof=1)) if n > 1 else None,
        "smallest": float(values.min()) if n else None,
        "largest": float(values.max()) if n else None,
    }
