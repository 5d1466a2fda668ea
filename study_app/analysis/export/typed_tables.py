"""The tables that are handed out, as typed frames with a description of every column; formats are made from them.

Settings are codes until the key was opened, and the sealed columns are left out; then condition, liquid and delay
(asked for, and achieved) are columns.
"""

from dataclasses import replace
from typing import Any, Final

import numpy as np
import pandas as pd

from study_app.analysis.export.delivered import JUDGED, Delivered, delivered, with_site
from study_app.analysis.export.level_tables import level_tables
from study_app.analysis.tables.compared_blocks import Setting
from study_app.analysis.tables.measures import AGREEMENT, LEVELS, QUARTILES
from study_app.analysis.tables.study_tables import Study
from study_app.store.tables.columns import RESPONSES, TRIALS_2, tables_of
from study_app.store.tables.csv_files import Column, header, optional, unsealed

OF_A_FORM: Final = Setting("")
"""Stands for the setting of an answer in a form, which has none."""

_BY_NAME: Final = {column.name: column for column in (*TRIALS_2, *RESPONSES)}

OPENED: Final = (
    Column("condition", "text", "Id of the condition that the code stands for."),
    Column("liquid", "text", "Id of the liquid that was presented."),
    Column("delay_ms", "number", "Requested visual delay.", "ms", minimum=0),
)
ACHIEVED: Final = optional(
    "delay_achieved_ms", "number", "Visual delay that was achieved: asked for, plus the trial's mean error.", "ms"
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
        "Presentations besides these that exclusions.csv leaves out one by one, with their answers.",
        minimum=0,
    ),
    Column("n", "integer", "Valid answers.", minimum=0),
    Column("cannot_judge", "integer", "Answers off the scale.", minimum=0),
    Column("missing", "integer", "Presentations without any answer.", minimum=0),
    *(Column(f"count_{level}", "integer", f"Answers at level {level}.", minimum=0) for level in LEVELS),
    optional("median", "number", "Median of the valid answers.", minimum=1, maximum=7),
    optional("q1", "number", f"Lower quartile; {_QUARTILE}.", minimum=1, maximum=7),
    optional("q3", "number", f"Upper quartile; {_QUARTILE}.", minimum=1, maximum=7),
    optional(
        "agree_percent",
        "number",
        f"Share of the valid answers that agree (levels {AGREEMENT[0]} to {AGREEMENT[-1]}).",
        "%",
        minimum=0,
        maximum=100,
    ),
)


def _may_miss(columns: tuple[Column, ...]) -> tuple[Column, ...]:
    """Return columns about a trial's setting where some rows have none: those of forms, and of tracks."""
    return tuple(replace(column, may_miss=True) for column in columns)


def deliver(study: Study) -> tuple[Delivered, ...]:
    """Return responses, trials and aggregate of a study; with levels, also intervals, opened tracks and thresholds."""
    opened = OPENED if study.revealed else ()
    achieved = (*OPENED, ACHIEVED) if study.revealed else ()
    trials = tables_of(study.protocol_format)["trials"]
    trials = trials if study.revealed else unsealed(trials)
    responses = tables_of(study.protocol_format)["responses"]
    about = achieved if responses is RESPONSES else _may_miss(achieved)
    tables = (
        delivered("responses", (*responses, *JUDGED, *about), _named(study, _with_delay_error(study))),
        delivered(
            "trials",
            (*trials, *JUDGED, *(_may_miss(achieved) if study.levels else achieved)),
            _named(study, study.trials),
        ),
        delivered("aggregate", (*_aggregate_head(), *opened, *MEASURED), _aggregate(study)),
        *level_tables(study),
    )
    return tuple(with_site(study, table) for table in tables)


def _named(study: Study, table: pd.DataFrame) -> pd.DataFrame:
    """Add what the code stood for, where the key is open."""
    if not study.revealed:
        return table
    pairs = list(zip(table["block"].to_numpy(), table["code"].to_numpy(), strict=True))
    places = {pair: place for place, pair in enumerate(dict.fromkeys(pairs))}
    which = np.fromiter((places[pair] for pair in pairs), dtype=np.int64, count=len(pairs))
    settings = [OF_A_FORM if pd.isna(pair[0]) else study.settings[pair] for pair in places]
    delay_ms = _delays_ms(settings)[which]
    return table.assign(
        condition=pd.array([one.condition for one in settings], dtype="string").take(which),
        liquid=pd.array([one.liquid for one in settings], dtype="string").take(which),
        delay_ms=delay_ms,
        delay_achieved_ms=(table["delay_error_mean_ms"] + delay_ms).round(6),
    )


def _delays_ms(settings: list[Setting]) -> Any:
    return np.array(
        [np.nan if setting.delay_ms is None else setting.delay_ms for setting in settings], dtype=np.float64
    )


def _with_delay_error(study: Study) -> pd.DataFrame:
    """Return the responses with the delay error of the trial each followed."""
    if not study.revealed:
        return study.answered
    trial = ["participant", "session", "trial", "attempt"]
    return study.answered.merge(study.trials[[*trial, "delay_error_mean_ms"]], on=trial, how="left")


def _aggregate_head() -> tuple[Column, ...]:
    return tuple(_BY_NAME[name] for name in ("study", "simulated", "pilot", "block", "code"))


def _aggregate(study: Study) -> pd.DataFrame:
    frames = []
    for block in study.blocks:
        settings = {setting.code: setting for setting in block.settings}
        found = study.aggregate(block)
        presented = [settings[code] for code in found["code"]]
        frames.append(
            found.assign(
                study=study.name,
                simulated=study.simulated,
                pilot=study.pilot,
                block=block.id,
                condition=pd.array([setting.condition for setting in presented], dtype="string"),
                liquid=pd.array([setting.liquid for setting in presented], dtype="string"),
                delay_ms=np.array([setting.delay_ms for setting in presented], dtype=np.float64),
                short=found["item"].map({item.id: item.short for item in block.items}),
            )
        )
    if not frames:
        names = [*header(_aggregate_head()), *header(OPENED), *header(MEASURED)]
        return pd.DataFrame({name: pd.Series(dtype=object) for name in names})
    return pd.concat(frames, ignore_index=True)
