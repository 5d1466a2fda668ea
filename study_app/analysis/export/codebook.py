"""The codebook of an export: the columns of every file, every statement, level and setting, and what was left out."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any

from study_app import __version__
from study_app.analysis.tables.compared_blocks import Block
from study_app.analysis.tables.measures import AGREEMENT, LEVELS, QUARTILES
from study_app.analysis.tables.study import Study
from study_app.store.blinded import blinding
from study_app.store.tables.columns import MISSING, SEALED, Column
from study_app.store.tables.formulas import COMPUTED


def codebook_bytes(study: Study, files: Mapping[str, Iterable[Column]]) -> bytes:
    """Return the codebook as JSON; ``files`` maps names to their columns."""
    described = {name: [_described(column) for column in columns] for name, columns in files.items()}
    text = json.dumps(_codebook(study, described), indent=2, ensure_ascii=False)
    return f"{text}\n".encode("utf-8", "backslashreplace")


def head(study: Study) -> dict[str, Any]:
    """Return what study it is, and how many took part."""
    return {
        "name": study.name,
        "title": study.title,
        "version": study.version,
        "participants": study.n,
        "sessions": len(study.participants),
        "sessions_left_out": study.left_out,
        "sessions_excluded": len(study.excluded_sessions),
        "simulated": study.simulated,
        "pilot": study.pilot,
    }


def _codebook(study: Study, files: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "study": head(study),
        "program": f"liquid-study {__version__}",
        "format": "CSV: UTF-8, comma, decimal point, RFC 4180 quoting; a text that begins with "
        f"{COMPUTED} has an apostrophe before it",
        "missing": MISSING,
        "blinded": not study.revealed,
        "sealed_columns": [] if study.revealed else sorted(SEALED),
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
                **_presentations(study, block),
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
            "repeated": "of a participant's repeated answers the median, except where single answers are used: the "
            "mixed model, the detection threshold, and the counts of levels",
            "counted": "main trials of completed sessions; of a repeated trial the last attempt; nothing excluded",
        },
        "files": files,
    }


def _presentations(study: Study, block: Block) -> dict[str, Any]:
    """Return how many answers a participant gave to a statement on one setting, and in which sessions."""
    answers = study.answers(block)
    given = answers[answers["response"].notna()].assign(column=answers["code"].map(block.columns))
    counts = given.groupby(["participant", "column", "item"]).size()
    return {
        "answers_per_participant_setting_and_item": [int(counts.min()), int(counts.max())] if len(counts) else [0, 0],
        "sessions": sorted({int(number) for number in given["session"]}),
        "replicates": [
            codes
            for place in sorted(set(block.columns.values()))
            if len(codes := [code for code, column in block.columns.items() if column == place]) > 1
        ],
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
