"""The codebook of an export: the columns of every file, every statement, level and setting, and what was left out."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any

from study_app import __version__
from study_app.analysis.export.level_tables import names_of_sealed
from study_app.analysis.export.stated_credits import stated_credits
from study_app.analysis.tables.compared_blocks import Block
from study_app.analysis.tables.level_blocks import LevelBlock
from study_app.analysis.tables.measures import AGREEMENT, LEVELS, QUARTILES
from study_app.analysis.tables.study_tables import Study
from study_app.store.blinded.unblinding import reveals_of
from study_app.store.tables.columns import SEALED
from study_app.store.tables.csv_files import COMPUTED, MISSING, Column


def codebook_bytes(study: Study, files: Mapping[str, Iterable[Column]]) -> bytes:
    """Return the codebook as JSON; ``files`` maps names to their columns."""
    described = {name: [_described(column) for column in columns] for name, columns in files.items()}
    text = json.dumps(_codebook(study, described), indent=2, ensure_ascii=False)
    return f"{text}\n".encode("utf-8", "backslashreplace")


def head(study: Study) -> dict[str, Any]:
    """Return what study it is, its authors, licence and citation, and how many took part."""
    return {
        "name": study.name,
        "title": study.title,
        "version": study.version,
        **stated_credits(study),
        "participants": study.n,
        **({"sites": list(study.sites)} if study.sites else {}),
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
        "sealed_columns": [] if study.revealed else sorted(SEALED | names_of_sealed(study)),
        "key_opened": list(reveals_of(study.folder)),
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
        **({"levels": [_levels(block) for block in study.levels]} if study.levels else {}),
        **({"questions": _questions(study)} if study.others.questions else {}),
        **({"scores": _scores(study)} if study.others.scores else {}),
        "measures": {
            "quartiles": QUARTILES,
            "agree_percent": f"levels {AGREEMENT[0]} to {AGREEMENT[-1]}, of the valid answers",
            "repeated": "of a participant's repeated answers the median, except where single answers are used: the "
            "mixed model, the detection threshold, and the counts of levels",
            "counted": "main trials of completed sessions; of a repeated trial the last attempt; nothing excluded",
        },
        "files": files,
    }


def _levels(block: LevelBlock) -> dict[str, Any]:
    """Return how a block of levels is built and, once the key is open, what it varies."""
    stimulus = block.stimulus
    return {
        "block": block.id,
        "title": block.title,
        "phase": block.phase,
        "design": block.design.kind,
        "item": block.design.name,
        **(
            {}
            if stimulus is None
            else {"vary": stimulus.vary, "level": stimulus.level_kind, "direction": stimulus.direction}
        ),
    }


def _questions(study: Study) -> list[dict[str, Any]]:
    """Return the questions that no block of statements holds."""
    return [
        {
            "form" if one.where.is_form else "block": one.where.id,
            "id": one.id,
            "kind": one.question.kind_id,
            "text": one.text,
            "short": one.short,
            **({"levels": one.levels} if one.levels else {}),
            **({"cannot_judge": one.cannot_judge} if one.cannot_judge else {}),
            **({"range": list(one.bounds)} if one.bounds else {}),
            **({"show_if": one.question.show_if.model_dump(mode="json")} if one.question.show_if else {}),
        }
        for one in study.others.questions
    ]


def _scores(study: Study) -> list[dict[str, Any]]:
    return [
        {
            "form" if one.where.is_form else "block": one.where.id,
            "name": one.name,
            "instrument": one.instrument,
            **one.score.model_dump(mode="json", exclude_defaults=True),
        }
        for one in study.others.scores
    ]


def _presentations(study: Study, block: Block) -> dict[str, Any]:
    """Return how many answers a participant gave to a statement on one setting, and in which sessions."""
    answers = study.answers(block)
    given = answers[answers["response"].notna()]
    given = given.assign(column=given["code"].map(block.columns))
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
