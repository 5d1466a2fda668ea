"""Tidy tables of all participants, with a codebook that explains every column, statement and level.

Settings are codes until the key was opened; then condition, liquid and delay (asked for, and achieved) stand beside.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import pandas as pd

from study_app import __version__
from study_app.analysis.measures import AGREEMENT, LEVELS, QUARTILES
from study_app.analysis.output import write_files
from study_app.analysis.tables import Study, load_study
from study_app.store import blinding
from study_app.store.columns import MISSING, PARTICIPANTS, RESPONSES, TRIALS, Column
from study_app.store.tables import csv_bytes

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


def export(folder: Path, to: Path, *, warn: Callable[[str], object] | None = None) -> tuple[Path, ...]:
    """Write responses, trials, aggregate and codebook of a study into the folder ``to``; return the files.

    Files that are not as they were recorded are used as they are: ``warn`` is told of each, and the codebook names it.

    Raises
    ------
    AnalysisError
        The results cannot be evaluated, or ``to`` cannot be written; nothing was.
    StoreError
        The key was opened, and is now missing or changed; or ``exclusions.csv`` cannot be read.
    """
    study = load_study(folder)
    opened = OPENED if study.revealed else ()
    achieved = (*OPENED, ACHIEVED) if study.revealed else ()
    tables: dict[str, tuple[tuple[Column, ...], list[dict[str, Any]]]] = {
        "responses": ((*RESPONSES, *JUDGED, *achieved), list(_rows(study, _with_delay_error(study)))),
        "trials": ((*TRIALS, *JUDGED, *achieved), list(_rows(study, study.trials))),
        "aggregate": ((*_aggregate_head(), *opened, *MEASURED), list(_aggregate_rows(study))),
    }
    names = {name: f"study-{study.name}_description-{name}_data.csv" for name in tables}
    files = {names[name]: csv_bytes(columns, rows) for name, (columns, rows) in tables.items()}
    described = {names[name]: [_described(column) for column in columns] for name, (columns, _) in tables.items()}
    codebook = json.dumps(_codebook(study, described), indent=2, ensure_ascii=False)
    written = write_files(Path(to), {**files, "codebook.json": f"{codebook}\n".encode()})
    study.tell_doubts(warn)
    return written


def _rows(study: Study, table: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Give the table's rows as plain values; where the key is open with what the code stood for."""
    for row in table.to_dict("records"):
        plain = {str(name): _plain(value) for name, value in row.items()}
        if study.revealed:
            setting = study.settings[plain["block"], plain["code"]]
            error = plain["delay_error_mean_ms"]
            plain |= {"condition": setting.condition, "liquid": setting.liquid, "delay_ms": setting.delay_ms}
            plain["delay_achieved_ms"] = None if error is None else round((setting.delay_ms or 0.0) + error, 6)
        yield plain


def _with_delay_error(study: Study) -> pd.DataFrame:
    """Return the responses with the delay error of the trial each followed."""
    trial = ["participant", "session", "trial", "attempt"]
    return study.responses.merge(study.trials[[*trial, "delay_error_mean_ms"]], on=trial, how="left")


def _aggregate_head() -> tuple[Column, ...]:
    return tuple(_BY_NAME[name] for name in ("study", "simulated", "pilot", "block", "code"))


def _aggregate_rows(study: Study) -> Iterator[dict[str, Any]]:
    for block in study.blocks:
        short = {item.id: item.short for item in block.items}
        settings = {setting.code: setting for setting in block.settings}
        for row in study.aggregate(block).to_dict("records"):
            setting = settings[row["code"]]
            yield {
                "study": study.name,
                "simulated": study.simulated,
                "pilot": study.pilot,
                "block": block.id,
                "condition": setting.condition,
                "liquid": setting.liquid,
                "delay_ms": setting.delay_ms,
                "short": short[row["item"]],
                **{str(name): _plain(value) for name, value in row.items()},
            }


def _plain(value: Any) -> Any:
    """Return a cell of a data frame as Python's own value, None where it is missing."""
    if pd.isna(value):
        return None
    return value.item() if hasattr(value, "item") else value


def _codebook(study: Study, files: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "study": {
            "name": study.name,
            "title": study.title,
            "version": study.version,
            "participants": study.n,
            "sessions": len(study.participants),
            "sessions_left_out": study.left_out,
            "sessions_excluded": len(study.excluded_sessions),
            "simulated": study.simulated,
            "pilot": study.pilot,
        },
        "program": f"liquid-study {__version__}",
        "format": "CSV: UTF-8, comma, decimal point, RFC 4180 quoting",
        "missing": MISSING,
        "blinded": not study.revealed,
        "key_opened": list(blinding.reveals(study.folder)),
        "doubts": [
            {"file": doubt.path.relative_to(study.folder).as_posix(), "what": doubt.what} for doubt in study.doubts
        ],
        "exclusions": [asdict(one) for one in study.exclusions],
        "blocks": [
            {
                "id": block.id,
                "title": block.title,
                "levels": {str(level): label for level, label in zip(LEVELS, block.labels, strict=True)},
                "cannot_judge": block.cannot_judge,
                "items": [{"id": item.id, "text": item.text, "short": item.short} for item in block.items],
                "settings": [
                    {
                        "code": setting.code,
                        **(
                            {"condition": setting.condition, "liquid": setting.liquid, "delay_ms": setting.delay_ms}
                            if block.revealed
                            else {}
                        ),
                    }
                    for setting in block.settings
                ],
            }
            for block in study.blocks
        ],
        "measures": {
            "quartiles": QUARTILES,
            "agree_percent": f"levels {AGREEMENT[0]} to {AGREEMENT[-1]}, of the valid answers",
            "counted": "main trials of completed sessions; of a repeated trial the last attempt; nothing excluded",
        },
        "files": files,
    }


def _described(column: Column) -> dict[str, Any]:
    described: dict[str, Any] = {"name": column.name, "type": column.kind, "description": column.description}
    if column.unit:
        described["unit"] = column.unit
    if column.levels:
        described["levels"] = dict(column.levels)
    if column.minimum is not None:
        described["minimum"] = column.minimum
    if column.maximum is not None:
        described["maximum"] = column.maximum
    described["may_miss"] = column.may_miss
    return described
