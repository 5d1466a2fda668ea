"""Tables as SPSS files (.sav), which jamovi, JASP and R can also read, with labels, levels and missing-value codes.

Answers are numbers with labels: options are nominal, scale points ordinal. In the wide table, the answer to a question
that was not shown is 96, an excluded answer 97, an answer off the scale 98 and an answer that was not given 99. These
codes are declared as missing. Other missing numbers are system-missing. As SPSS has no missing texts, these are empty.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from study_app.analysis.data.blocks import PlacedQuestion, PlacedScore
from study_app.analysis.data.measures import LEVELS
from study_app.analysis.data.study_tables import Study
from study_app.analysis.export.tables import Cells, ExportTable, QuestionCells
from study_app.store.files import Column

_NOT_SHOWN: Final = 96
_EXCLUDED: Final = 97
_CANNOT_JUDGE: Final = 98
_NOT_ANSWERED: Final = 99
_CODES: Final = frozenset((_NOT_SHOWN, _EXCLUDED, _CANNOT_JUDGE, _NOT_ANSWERED))
_NAME_BYTES: Final = 64
_LABEL_BYTES: Final = 255
_VALUE_LABEL_BYTES: Final = 120
_FILE_LABEL_BYTES: Final = 64
_TEXT_BYTES: Final = 32_767
_RESERVED: Final = frozenset(("ALL", "AND", "BY", "EQ", "GE", "GT", "LE", "LT", "NE", "NOT", "OR", "TO", "WITH"))


def wide_sav(study: Study, table: ExportTable, cells: Mapping[str, Cells | QuestionCells]) -> bytes:
    """Return the wide table as an SPSS file."""
    answers = study.responses
    by_cell = dict(iter(answers.groupby(["block", "code", "item"])))
    by_setting = dict(iter(study.answered.groupby(["block", "code"])))
    frame = table.frame.copy()
    coded = {}
    for name, cell in cells.items():
        if isinstance(cell, QuestionCells):
            frame[name], coded[name] = _code_question(study, cell, frame[name], frame["participant"])
            continue
        rows = by_cell.get((cell.block.id, cell.setting.code, cell.item.id), answers.head(0))
        asked = by_setting.get((cell.block.id, cell.setting.code), study.answered.head(0))
        frame[name] = _code_missing_answers(frame[name], frame["participant"], rows, asked)
        coded[name] = _value_labels(dict(zip(LEVELS, cell.block.labels, strict=True)), cell.block.cannot_judge or "")
    numbered = {name for name, labels in coded.items() if labels}
    columns = tuple(replace(column, kind="number") if column.name in numbered else column for column in table.columns)
    options = {name for name, cell in cells.items() if isinstance(cell, QuestionCells) and _has_options(cell.asked)}
    return sav(study, ExportTable(table.name, columns, frame), {name: coded[name] for name in numbered}, options)


def _has_options(question: PlacedQuestion | PlacedScore) -> bool:
    """Return whether the answers to a question are options, which are not ordered."""
    return not isinstance(question, PlacedScore) and question.question.value_type == "text"


def _code_question(
    study: Study, cells: QuestionCells, values: pd.Series[Any], people: pd.Series[Any]
) -> tuple[pd.Series[Any], dict[int, str]]:
    """Return the cells of a question other than a statement, and its value labels; options are numbered from 1."""
    question = cells.asked
    if isinstance(question, PlacedScore) or not question.levels:
        return values, {}
    rows, asked = study.rows_of(question), study.rows_in(question.where)
    rows = cells.select(rows[rows["counted"]])
    if cells.setting is not None:
        asked = asked[asked["code"] == cells.setting.code]
    if cells.occasion is not None:
        asked = asked[asked["session"] == cells.occasion[0]]
    if _has_options(question):
        if question.question.names_several:
            return values, {}
        numbers = {option: number for number, option in enumerate(question.levels, start=1)}
        coded = _code_missing_answers(values.map(numbers), people, rows, asked)
        return coded, _value_labels({numbers[option]: words for option, words in question.levels.items()}, "")
    levels = {int(point): words for point, words in question.levels.items()}
    return _code_missing_answers(values, people, rows, asked), _value_labels(levels, question.cannot_judge or "")


def _code_missing_answers(
    values: pd.Series[Any], people: pd.Series[Any], rows: pd.DataFrame, asked: pd.DataFrame
) -> pd.Series[Any]:
    """Return one cell per participant, with a code for the reason of a missing answer.

    ``rows`` are all answers to the question, with a row without an answer if it was shown; ``asked`` are those to all
    questions of its questionnaire.
    """
    counted = rows[rows["counted"]]
    judged = set(counted.loc[counted["cannot_judge"].fillna(False), "participant"])
    completed = set(asked.loc[asked["counted"], "participant"])
    excluded = set(asked.loc[asked["excluded"], "participant"]) - completed
    coded = values.astype("Float64")
    for code, participants in (
        (_CANNOT_JUDGE, judged),
        (_EXCLUDED, excluded),
        (_NOT_SHOWN, completed - set(counted["participant"])),
    ):
        coded = coded.mask(coded.isna() & people.isin(participants), code)
    return coded.fillna(_NOT_ANSWERED)


def _value_labels(levels: Mapping[int, str], cannot_judge: str) -> dict[int, str]:
    off = {
        _NOT_SHOWN: "Not shown",
        _EXCLUDED: "Excluded",
        _CANNOT_JUDGE: cannot_judge or "Cannot judge",
        _NOT_ANSWERED: "No answer",
    }
    return {**levels, **off}


def sav(study: Study, table: ExportTable, coded: Mapping[str, dict[int, str]], options: Collection[str] = ()) -> bytes:
    """Return the table as an SPSS file.

    ``coded`` has the value labels of columns whose missing answers have codes; the columns in ``options`` are nominal.
    """
    names = _spss_names([column.name for column in table.columns])
    columns = {names[column.name]: column for column in table.columns}
    levels = {names[name]: found for name, found in coded.items()}
    ordered = {names[name] for name in coded.keys() - set(options)}
    flags = {name: {0: "false", 1: "true"} for name, column in columns.items() if column.kind == "flag"}
    frame = pd.DataFrame(
        {names[column.name]: _plain_values(column, table.frame[column.name]) for column in table.columns}
    )
    import pyreadstat  # noqa: PLC0415  # only this table needs it

    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch) / "table.sav"
        pyreadstat.write_sav(
            frame,
            str(path),
            file_label=_truncate(f"{study.title} ({study.name} {study.version})", _FILE_LABEL_BYTES),
            column_labels={
                name: _truncate(_column_label(name, column), _LABEL_BYTES) for name, column in columns.items()
            },
            variable_value_labels={
                name: {value: _truncate(label, _VALUE_LABEL_BYTES) for value, label in found.items()}
                for name, found in (levels | flags).items()
            },
            missing_ranges={  # SPSS permits at most three single codes
                name: [{"lo": min(codes), "hi": max(codes)}]
                for name, level in levels.items()
                if (codes := _CODES & level.keys())
            },
            variable_measure={
                name: "ordinal" if name in ordered else "nominal" if name in levels else _measurement_level(column)
                for name, column in columns.items()
            },
            variable_format={
                name: form
                for name, column in columns.items()
                if (form := _display_format(column, table.frame[column.name]))
            },
        )
        return path.read_bytes()


def _spss_names(names: list[str]) -> dict[str, str]:
    """Return valid SPSS names: starting with a letter, at most 64 bytes, not reserved, unique regardless of case."""
    spss_names: dict[str, str] = {}
    used: set[str] = set()
    for name in names:
        valid = re.sub(r"[^A-Za-z0-9_]", "_", name).rstrip("_") or "v"
        if not valid[0].isalpha() or valid.upper() in _RESERVED:
            valid = f"v_{valid}"
        unique, number = valid[:_NAME_BYTES], 1
        while unique.upper() in used:
            number += 1
            unique = f"{valid[: _NAME_BYTES - len(str(number)) - 1]}_{number}"
        used.add(unique.upper())
        spss_names[name] = unique
    return spss_names


def _plain_values(column: Column, values: pd.Series[Any]) -> pd.Series[Any]:
    """Return values in the library's types: floats with NaN, or texts with "" for missing ones."""
    if column.kind in {"text", "time"}:
        texts = ["" if value is pd.NA else _truncate(str(value), _TEXT_BYTES) for value in values.tolist()]
        return pd.Series(texts, dtype=object)
    return pd.Series(values.astype("Float64").to_numpy(dtype=np.float64, na_value=np.nan))


def _column_label(name: str, column: Column) -> str:
    unit = f" [{column.unit}]" if column.unit else ""
    return f"{column.description}{unit}" if name == column.name else f"{column.name}: {column.description}{unit}"


def _measurement_level(column: Column) -> str:
    return "nominal" if column.kind in {"text", "time", "flag"} else "scale"


def _display_format(column: Column, values: pd.Series[Any]) -> str | None:
    """Return the display format of numbers; integers have no decimal point."""
    if column.kind == "flag":
        return "F1.0"
    whole = column.kind == "integer"
    return f"F{max(2, len(str(values.max()).partition('.')[0]))}.0" if whole and values.notna().any() else None


def _truncate(text: str, most: int) -> str:
    """Return a text truncated to ``most`` bytes without splitting a character."""
    content = text.encode("utf-8", "replace")
    return text if len(content) <= most else content[: most - 3].decode("utf-8", "ignore") + "…"
