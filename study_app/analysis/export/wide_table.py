"""The answers as a wide table: a row a participant, a column a statement and setting; for SPSS, JASP and jamovi."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
import pandas as pd

from study_app.analysis.designs.question_measures import scored
from study_app.analysis.export.delivered import Delivered, with_site
from study_app.analysis.tables.asked_questions import AskedQuestion, AskedScore
from study_app.analysis.tables.compared_blocks import Block, Item, Setting, setting_name
from study_app.analysis.tables.measures import Array, by_participant
from study_app.analysis.tables.study_tables import Study
from study_app.store.tables.columns import RESPONSES
from study_app.store.tables.csv_files import Column, Kind, optional

_PARTICIPANT = next(column for column in RESPONSES if column.name == "participant")
_SIMULATED = next(column for column in RESPONSES if column.name == "simulated")


@dataclass(frozen=True, slots=True)
class Cells:
    """What a column of the wide table holds: answers to an item about a setting of a block."""

    block: Block
    setting: Setting
    item: Item


@dataclass(frozen=True, slots=True)
class QuestionCells:
    """What a column holds of another question: answers about a setting, or in a form; or a score of a questionnaire."""

    asked: AskedQuestion | AskedScore
    setting: Setting | None


def wide(study: Study) -> tuple[Delivered, dict[str, Cells | QuestionCells]]:
    """Return the wide table of all answers that count, and what each of its columns holds.

    Columns are ``item__condition``, or ``item__code`` until the key was opened; where a study has blocks that would
    give the same name, ``block__item__condition``. A repeated setting gives the median, as in the analysis, of options
    and texts the last one. Questions of forms are ``form__item``, scores ``form__score``.
    """
    cells = [
        Cells(block, setting, item) for block in study.blocks for setting in block.settings for item in block.items
    ]
    often = Counter(_name(one) for one in cells)
    named = {_name(one) if often[_name(one)] == 1 else f"{one.block.id}__{_name(one)}": one for one in cells}
    people = list(study.people)
    simulated = dict(zip(study.participants["participant"], study.participants["simulated"], strict=True))
    frame = pd.DataFrame(
        {
            "participant": pd.array(people, dtype="string"),
            "simulated": pd.array([bool(simulated[person]) for person in people], dtype="boolean"),
            **{name: _answers(study, one, people) for name, one in named.items()},
        }
    )
    others = _others(study)
    frame = frame.assign(**{name: _question_answers(study, one, people) for name, one in others.items()})
    columns = (
        _PARTICIPANT,
        _SIMULATED,
        *(_column(name, one, frame) for name, one in named.items()),
        *(_question_column(name, one, frame) for name, one in others.items()),
    )
    return with_site(study, Delivered("wide", columns, frame)), {**named, **others}


def _others(study: Study) -> dict[str, QuestionCells]:
    """Return the columns of other questions and of scores, by name."""
    found: dict[str, QuestionCells] = {}
    asked: tuple[AskedQuestion | AskedScore, ...] = (*study.others.questions, *study.others.scores)
    levels = {block.id for block in study.levels}  # their answers are pooled by no track: see the table of tracks
    for one in (one for one in asked if one.where.id not in levels):
        called = one.name if isinstance(one, AskedScore) else one.id
        for setting in one.where.settings or (None,):
            ending = "" if setting is None else f"__{setting.condition or setting.code}"
            found[f"{one.where.id}__{called}{ending}"] = QuestionCells(one, setting)
    return found


def _question_answers(study: Study, cells: QuestionCells, people: list[str]) -> pd.api.extensions.ExtensionArray:
    if isinstance(cells.asked, AskedScore):
        return _medians(_about(scored(study, cells.asked), cells), "score", people)
    answers = _about(study.answers_to(cells.asked), cells)
    if cells.asked.question.value_type != "text":
        return _medians(answers, "value", people)
    given_answers = answers.sort_values(["session", "trial"]).groupby("participant")["response"].last()
    return pd.array([given_answers.get(person, pd.NA) for person in people], dtype="string")


def _about(answers: pd.DataFrame, cells: QuestionCells) -> pd.DataFrame:
    return answers if cells.setting is None else answers[answers["code"] == cells.setting.code]


def _medians(answers: pd.DataFrame, column: str, people: list[str]) -> pd.api.extensions.ExtensionArray:
    """Return the median of each participant's numbers."""
    given_answers = answers[answers[column].notna()].assign(number=lambda rows: rows[column].astype(float))
    found = given_answers.groupby("participant")["number"].median()
    values = np.array([found.get(person, np.nan) for person in people], dtype=np.float64)
    return _numbers(values)


def _question_column(name: str, cells: QuestionCells, frame: pd.DataFrame) -> Column:
    asked, setting = cells.asked, cells.setting
    kind: Kind = "integer" if pd.api.types.is_integer_dtype(frame[name]) else "number"
    about = "" if setting is None else f" About {setting_name(setting, asked.where.settings)}."
    if isinstance(asked, AskedScore):
        of = f" of {asked.instrument}" if asked.instrument else ""
        return optional(name, kind, f"Score {asked.name}{of}, in {asked.where.title}.{about}")
    text = asked.text if asked.text.endswith((".", "?", "!")) else f"{asked.text}."
    described = f"{text} In {asked.where.title}.{about}"
    if asked.question.value_type == "text":
        return optional(name, "text", described)
    least, most = asked.bounds or (None, None)
    return optional(name, kind, described, minimum=least, maximum=most)


def _name(cells: Cells) -> str:
    return f"{cells.item.id}__{cells.setting.condition or cells.setting.code}"


def _answers(study: Study, cells: Cells, people: list[str]) -> pd.api.extensions.ExtensionArray:
    answers = study.answers(cells.block)
    here = answers[(answers["code"] == cells.setting.code) & (answers["item"] == cells.item.id)]
    return _numbers(by_participant(here, people, {cells.setting.code: 0}, cells.item.id)[:, 0])


def _numbers(values: Array) -> pd.api.extensions.ExtensionArray:
    """Return numbers with missing ones, whole where all are."""
    missing = np.isnan(values)
    known = np.where(missing, 0, values)
    if (known == np.floor(known)).all():
        return pd.arrays.IntegerArray(known.astype(np.int64), missing)
    return pd.arrays.FloatingArray(known, missing)


def _column(name: str, cells: Cells, frame: pd.DataFrame) -> Column:
    return optional(
        name,
        "integer" if pd.api.types.is_integer_dtype(frame[name]) else "number",
        f"{cells.item.text} About {cells.block.name(cells.setting)}, in {cells.block.title}.",
        minimum=1,
        maximum=7,
    )
