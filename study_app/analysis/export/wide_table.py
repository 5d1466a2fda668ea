"""The answers as a wide table: a row a participant, a column a statement and setting; for SPSS, JASP and jamovi."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
import pandas as pd

from study_app.analysis.export.typed_tables import Delivered
from study_app.analysis.tables.compared_blocks import Block, Item, Setting
from study_app.analysis.tables.measures import by_participant
from study_app.analysis.tables.study import Study
from study_app.store.tables.columns import RESPONSES, Column

_PARTICIPANT = next(column for column in RESPONSES if column.name == "participant")
_SIMULATED = next(column for column in RESPONSES if column.name == "simulated")


@dataclass(frozen=True, slots=True)
class Cells:
    """What a column of the wide table holds: answers to an item about a setting of a block."""

    block: Block
    setting: Setting
    item: Item


def wide(study: Study) -> tuple[Delivered, dict[str, Cells]]:
    """Return the wide table of all answers that count, and what each of its columns holds.

    Columns are ``item__condition``, or ``item__code`` until the key was opened; where a study has blocks that would
    give the same name, ``block__item__condition``. A repeated setting gives the median, as in the analysis.
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
    columns = (_PARTICIPANT, _SIMULATED, *(_column(name, one, frame) for name, one in named.items()))
    return Delivered("wide", columns, frame), named


def _name(cells: Cells) -> str:
    return f"{cells.item.id}__{cells.setting.condition or cells.setting.code}"


def _answers(study: Study, cells: Cells, people: list[str]) -> pd.api.extensions.ExtensionArray:
    answers = study.answers(cells.block)
    here = answers[(answers["code"] == cells.setting.code) & (answers["item"] == cells.item.id)]
    values = by_participant(here, people, {cells.setting.code: 0}, cells.item.id)[:, 0]
    missing = np.isnan(values)
    known = np.where(missing, 0, values)
    if (known == np.floor(known)).all():
        return pd.arrays.IntegerArray(known.astype(np.int64), missing)
    return pd.arrays.FloatingArray(known, missing)


def _column(name: str, cells: Cells, frame: pd.DataFrame) -> Column:
    return Column(
        name,
        "integer" if pd.api.types.is_integer_dtype(frame[name]) else "number",
        f"{cells.item.text} About {cells.block.name(cells.setting)}, in {cells.block.title}.",
        minimum=1,
        maximum=7,
        may_miss=True,
    )
