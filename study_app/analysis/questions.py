"""Questions that no block of statements holds: their answers, measures and scores."""

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
    """A measure.

    ``of`` returns the numbers of a group of answers by name, from rows with ``response``, ``value`` and
    ``cannot_judge``. ``cells`` returns the cells of a table row by heading; a measure without cells lists its
    ``texts``.
    """

    id: str
    of: Callable[[PlacedQuestion, pd.DataFrame], Numbers]
    cells: Callable[[PlacedQuestion, Numbers], Mapping[str, str]] | None


def given_answers(answers: pd.DataFrame) -> pd.DataFrame:
    """Return the answers without missing ones and those off the scale."""
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


def _distribution(_asked: PlacedQuestion, answers: pd.DataFrame) -> Numbers:
    values = given_answers(answers)["value"].to_numpy(dtype=float)
    return {
        **counts_of_missing(answers),
        **quartiles_or_none(values)._asdict(),
        "smallest": float(values.min()) if len(values) else None,
        "largest": float(values.max()) if len(values) else None,
        "values": sorted(float(value) for value in values),
    }


def _distribution_cells(_asked: PlacedQuestion, numbers: Numbers) -> dict[str, str]:
    least, most = numbers["smallest"], numbers["largest"]
    return {
        "n": str(numbers["n"]),
        "missing": str(numbers["missing"]),
        **_quartile_cells(numbers),
        "range": "–" if least is None else f"{number(least, 1)} – {number(most, 1)}",
    }


_DISTRIBUTION: Final = Measure("distribution", _distribution, _distribution_cells)


def _option_counts(asked: PlacedQuestion, answers: pd.DataFrame) -> Numbers:
    chosen = [asked.question.counted(str(response)) for response in given_answers(answers)["response"]]
    return {
        **counts_of_missing(answers),
        "counts": {option: sum(option in one for one in chosen) for option in asked.levels},
    }


def _option_cells(asked: PlacedQuestion, numbers: Numbers) -> dict[str, str]:
    total = numbers["n"] or 1
    return {
        **{
            words: f"{(count := numbers['counts'][option])} ({100 * count / total:.0f} %)"
            for option, words in asked.levels.items()
        },
        "n": str(numbers["n"]),
        "missing": str(numbers["missing"]),
    }


_OPTION_COUNTS: Final = Measure("counts", _option_counts, _option_cells)


def _point_counts(asked: PlacedQuestion, answers: pd.DataFrame) -> Numbers:
    chosen = given_answers(answers)["response"].value_counts()
    return {
        **counts_of_missing(answers),
        "counts": {point: int(chosen.get(point, 0)) for point in asked.levels},
        **quartiles_or_none(given_answers(answers)["value"].to_numpy(dtype=float))._asdict(),
    }


def _point_cells(_asked: PlacedQuestion, numbers: Numbers) -> dict[str, str]:
    return {
        **{point: str(count) for point, count in numbers["counts"].items()},
        "n": str(numbers["n"]),
        "missing": str(numbers["missing"] + numbers["cannot_judge"]),
        **_quartile_cells(numbers),
    }


_POINT_COUNTS: Final = Measure("rating", _point_counts, _point_cells)


def _texts(_asked: PlacedQuestion, answers: pd.DataFrame) -> Numbers:
    texts = given_answers(answers).sort_values(["participant", "session"], kind="stable")
    pairs = zip(texts["participant"], texts["response"], strict=True)
    return {**counts_of_missing(answers), "texts": [f"{person}: {text}" for person, text in pairs]}


_TEXTS: Final = Measure("texts", _texts, None)


MEASURES: Final = {measure.id: measure for measure in (_POINT_COUNTS, _OPTION_COUNTS, _DISTRIBUTION, _TEXTS)}
"""Every measure by the id that a kind of question names it by."""

_ONE: Final = ["participant", "session", "trial"]


def question_results(study: Study) -> tuple[QuestionResult, ...]:
    """Return the numbers of every question in session order."""
    return tuple(_question_result(study, asked) for asked in study.others.questions)


def score_results(study: Study) -> tuple[ScoreResult, ...]:
    """Return every score in session order."""
    return tuple(_score(study, asked) for asked in study.others.scores)


def _question_result(study: Study, asked: PlacedQuestion) -> QuestionResult:
    measure, parts = by_name(MEASURES, asked.question.measure), groups_shown(study)
    return QuestionResult(
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
            GroupAnswers(code, group if group and code is None else with_group(name, group), measure.of(asked, rows))
            for of_groups in zip(*(_groups(asked.where, part.answers_to(asked)) for _, part in parts), strict=True)
            for (group, _), (code, name, rows) in zip(parts, of_groups, strict=True)
        ),
        options=asked.levels,
        weighs=any(
            asked.id in score.score.weights_from for score in study.others.scores if score.where.id == asked.where.id
        ),
    )


def _groups(where: QuestionPlace, answers: pd.DataFrame) -> Iterator[tuple[str | None, str, pd.DataFrame]]:
    """Yield the answers about each setting with code and name, or all answers in a form that is asked once."""
    if not where.settings:
        yield None, "All", answers
    for setting in where.settings:
        yield setting.code, where.name(setting), answers[answers["code"] == setting.code]


def scored(study: Study, asked: PlacedScore) -> pd.DataFrame:
    """Return one row per completed questionnaire: ``participant``, ``code`` and ``score``."""
    rows = pd.concat([study.answers_to(question) for question in asked.questions])
    bounds = {question.id: question.bounds for question in asked.questions}
    scores: list[dict[str, Any]] = []
    one = _ONE if not asked.where.is_form else [*_ONE, "code"]
    for (participant, *_), answers in rows.groupby(one, dropna=False, sort=True):
        answered = {
            str(item): str(response) if pd.isna(value) else float(value)
            for item, response, value in zip(answers["item"], answers["response"], answers["value"], strict=True)
            if not pd.isna(response)
        }
        code = str(answers["code"].iloc[0]) if asked.where.settings else None
        scores.append({"participant": participant, "code": code, "score": asked.score.compute(answered, bounds)})
    return pd.DataFrame(scores, columns=["participant", "code", "score"])


def _score(study: Study, asked: PlacedScore) -> ScoreResult:
    known = asked.instrument is not None and asked.instrument in Instrument.names()
    return ScoreResult(
        where=asked.where.id,
        title=asked.where.title,
        name=asked.name,
        instrument=asked.instrument,
        source=str(Instrument(asked.instrument).table["source"]) if known and asked.instrument is not None else None,
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
