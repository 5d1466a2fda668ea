"""The tables that are handed out, as typed frames with a description of every column; formats are made from them.

Settings are codes until the key was opened, and the sealed columns are left out; then condition, liquid and delay
(asked for, and achieved) stand beside.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pandas as pd

from study_app.analysis.tables.compared_blocks import Setting
from study_app.analysis.tables.measures import AGREEMENT, LEVELS, QUARTILES
from study_app.analysis.tables.study import Study
from study_app.store.tables.columns import PARTICIPANTS, RESPONSES, TRIALS, Column, header, unsealed

_STATUS: Final = next(column for column in PARTICIPANTS if column.name == "status")
_BY_NAME: Final = {column.name: column for column in (*TRIALS, *RESPONSES)}

JUDGED: Final = (
    Column("session_status", "text", "How the row's session ended.", levels=_STATUS.levels),
    Column("excluded", "flag", "true where exclusions.csv leaves out the row's session or trial."),
    Column("exclusion_reason", "text", "Why it is left out.", may_miss=True),
    Column(
        "counted",
        "flag",
        "true where the row is in the aggregate and the figures: main trial, completed session, last attempt, not "
        "excluded.",
    ),
)
OPENED: Final = (
    Column("condition", "text", "Id of the condition that the code stands for."),
    Column("liquid", "text", "Id of the liquid that was felt."),
    Column("delay_ms", "number", "Visual delay that was asked for.", "ms", minimum=0),
)
ACHIEVED: Final = Column(
    "delay_achieved_ms",
    "number",
    "Visual delay that was achieved: asked for, plus the trial's mean error.",
    "ms",
    may_miss=True,
)
_QUARTILE: Final = f"quartiles {QUARTILES}"
MEASURED: Final = (
    Column("item", "text", "Id of the statement; its words are in the codebook."),
    Column("short", "text", "A few words for the statement."),
    Column("participants", "integer", "Participants who gave a valid answer.", minimum=0),
    Column("presented", "integer", "Presentations after which the statement was to be answered.", minimum=0),
    Column(
        "presented_excluded",
        "integer",
        "Presentations beside these that exclusions.csv leaves out one by one, with their answers.",
        minimum=0,
    ),
    Column("n", "integer", "Valid answers.", minimum=0),
    Column("cannot_judge", "integer", "Answers off the scale.", minimum=0),
    Column("missing", "integer", "Presentations without any answer.", minimum=0),
    *(Column(f"count_{level}", "integer", f"Answers at level {level}.", minimum=0) for level in LEVELS),
    Column("median", "number", "Median of the valid answers.", minimum=1, maximum=7, may_miss=True),
    Column("q1", "number", f"Lower quartile; {_QUARTILE}.", minimum=1, maximum=7, may_miss=True),
    Column("q3", "number", f"Upper quartile; {_QUARTILE}.", minimum=1, maximum=7, may_miss=True),
    Column(
        "agree_percent",
        "number",
        f"Share of the valid answers that agree (levels {AGREEMENT[0]} to {AGREEMENT[-1]}).",
        "%",
        minimum=0,
        maximum=100,
        may_miss=True,
    ),
)


@dataclass(frozen=True, eq=False)
class Delivered:
    """A table: its name, its columns in their order, and a frame that has them."""

    name: str
    columns: tuple[Column, ...]
    frame: pd.DataFrame


def deliver(study: Study) -> tuple[Delivered, ...]:
    """Return responses, trials and aggregate of a study."""
    opened = OPENED if study.revealed else ()
    achieved = (*OPENED, ACHIEVED) if study.revealed else ()
    trials = TRIALS if study.revealed else unsealed(TRIALS)
    return (
        _delivered("responses", (*RESPONSES, *JUDGED, *achieved), _named(study, _with_delay_error(study))),
        _delivered("trials", (*trials, *JUDGED, *achieved), _named(study, study.trials)),
        _delivered("aggregate", (*_aggregate_head(), *opened, *MEASURED), _aggregate(study)),
    )


def _delivered(name: str, columns: tuple[Column, ...], frame: pd.DataFrame) -> Delivered:
    return Delivered(name, columns, frame[list(header(columns))])


def _named(study: Study, table: pd.DataFrame) -> pd.DataFrame:
    """Add what the code stood for, where the key is open."""
    if not study.revealed:
        return table
    pairs = list(zip(table["block"].to_numpy(), table["code"].to_numpy(), strict=True))
    places = {pair: place for place, pair in enumerate(dict.fromkeys(pairs))}
    which = np.fromiter((places[pair] for pair in pairs), dtype=np.int64, count=len(pairs))
    settings = [study.settings[pair] for pair in places]
    delay_ms = _delays_ms(settings)[which]
    return table.assign(
        condition=pd.array([one.condition for one in settings], dtype="string").take(which),
        liquid=pd.array([one.liquid for one in settings], dtype="string").take(which),
        delay_ms=delay_ms,
        delay_achieved_ms=(table["delay_error_mean_ms"] + delay_ms).round(6),
    )


def _delays_ms(settings: list[Setting]) -> Any:
    return np.array([setting.delay_ms or 0.0 for setting in settings], dtype=np.float64)


def _with_delay_error(study: Study) -> pd.DataFrame:
    """Return the responses with the delay error of the trial each followed."""
    if not study.revealed:
        return study.responses
    trial = ["participant", "session", "trial", "attempt"]
    return study.responses.merge(study.trials[[*trial, "delay_error_mean_ms"]], on=trial, how="left")


def _aggregate_head() -> tuple[Column, ...]:
    return tuple(_BY_NAME[name] for name in ("study", "simulated", "pilot", "block", "code"))


def _aggregate(study: Study) -> pd.DataFrame:
    frames = []
    for block in study.blocks:
        settings = {setting.code: setting for setting in block.settings}
        found = study.aggregate(block)
        told = [settings[code] for code in found["code"]]
        frames.append(
            found.assign(
                study=study.name,
                simulated=study.simulated,
                pilot=study.pilot,
                block=block.id,
                condition=pd.array([setting.condition for setting in told], dtype="string"),
                liquid=pd.array([setting.liquid for setting in told], dtype="string"),
                delay_ms=np.array([setting.delay_ms for setting in told], dtype=np.float64),
                short=found["item"].map({item.id: item.short for item in block.items}),
            )
        )
    return pd.concat(frames, ignore_index=True)
