"""A table of the participants' background by group or site: numbers and choices from forms that are completed once."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from study_app.analysis.data.blocks import PlacedQuestion
from study_app.analysis.data.study_tables import By, Study, group_members
from study_app.analysis.html_page import paragraph, table
from study_app.analysis.questions import MEASURES
from study_app.analysis.wording import number
from study_app.discovery import by_name


def background_table(study: Study, groups: Sequence[str], by: By) -> Iterator[str]:
    """Yield a table of the answers to numbers and choices in each group; nothing without such questions."""
    members = group_members(study) if by == "group" else {person: study.site_of(person) for person in study.people}
    rows = [
        row
        for question in study.others.questions
        if question.where.is_form and not question.where.settings
        for row in _question_rows(question, study.answers_to(question), members, groups)
    ]
    if rows:
        yield table(("Question", *groups), rows)
        yield paragraph(
            "The table shows numbers as mean ± standard deviation, and how often each option was chosen (in percent of "
            "the answers).",
            "soft",
        )


def _question_rows(
    question: PlacedQuestion, answers: pd.DataFrame, members: Mapping[str, str], groups: Sequence[str]
) -> Iterator[list[str]]:
    """Yield one row for a number or one for each option of a choice, with a cell for each group."""
    measure = by_name(MEASURES, question.question.measure)
    groups_of_rows = answers["participant"].map(members)
    numbers = [measure.of(question, answers[groups_of_rows == group]) for group in groups]
    if question.question.kind_id == "number":
        unit = f" ({question.unit})" if question.unit else ""
        yield [f"{question.short}{unit}", *map(_number_cell, numbers)]
    elif measure.id == "counts":
        for option, text in question.levels.items():
            yield [f"{question.short}: {text}", *(_count_cell(counts, option) for counts in numbers)]


def _number_cell(numbers: Mapping[str, Any]) -> str:
    values, n = numbers["values"], numbers["n"]
    if not n:
        return "–"
    sd = float(np.std(values, ddof=1)) if n > 1 else math.nan
    return f"{number(float(np.mean(values)))}{f' ± {number(sd)}' if n > 1 else ''} (n = {n})"


def _count_cell(numbers: Mapping[str, Any], option: str) -> str:
    count, n = numbers["counts"][option], numbers["n"]
    return f"{count} of {n} ({100 * count / n:.0f} %)" if n else "–"
