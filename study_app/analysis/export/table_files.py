"""The tables of a study as files, with codebook and credits: CSV, and other formats on request."""

import io
import json
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import asdict
from types import MappingProxyType
from typing import Any, Final, Literal, TypeAlias

from study_app import __version__
from study_app.analysis.data.blocks import Block, LevelBlock
from study_app.analysis.data.measures import AGREEMENT, LEVELS, QUARTILES
from study_app.analysis.data.study_tables import Study
from study_app.analysis.export import spss
from study_app.analysis.export.tables import Cells, ExportTable, QuestionCells, sealed_interval_columns
from study_app.analysis.levels.statistic import statistics
from study_app.store.files import COMPUTED, MISSING, SEALED, Column, csv_bytes, header
from study_app.store.unblinding import reveals_of

_CREDITS: Final = {"authors": "author", "license": "license", "citation": "citation", "funder": "funder", "url": "url"}
"""Keys of ``[study.credits]``, and the corresponding properties of schema.org."""

Extra: TypeAlias = Literal["wide", "parquet", "sav", "psych-ds"]
NOTHING_ELSE: Final[frozenset[Extra]] = frozenset()


def table_files(
    study: Study,
    tables: Sequence[ExportTable],
    extras: Collection[Extra] = NOTHING_ELSE,
    cells: Mapping[str, Cells | QuestionCells] = MappingProxyType({}),
) -> dict[str, bytes]:
    """Return tables of a study in CSV and the formats of ``extras``, and their codebook, by file name.

    With ``extras`` the wide table is the last of ``tables``, and ``cells`` describes its columns.
    """
    written = tables if "wide" in extras or not extras else tables[:-1]
    files = {file_name(study, table, "csv"): table_bytes(table) for table in written}
    columns = {file_name(study, table, "csv"): table.columns for table in written}
    files["codebook.json"] = codebook_bytes(study, columns)
    if "parquet" in extras:
        files |= {file_name(study, table, "parquet"): _parquet_bytes(table) for table in written}
    if "sav" in extras:
        opened = {"tracks", *(statistic.table for statistic in statistics())}
        files[file_name(study, tables[0], "sav")] = spss.sav(study, tables[0], {})
        files[file_name(study, tables[-1], "sav")] = spss.wide_sav(study, tables[-1], cells)
        files |= {
            file_name(study, table, "sav"): spss.sav(study, table, {}) for table in tables if table.name in opened
        }
    return files


def codebook_bytes(study: Study, files: Mapping[str, Iterable[Column]]) -> bytes:
    """Return the codebook as JSON; ``files`` maps file names to their columns."""
    described = {name: [_describe_column(column) for column in columns] for name, columns in files.items()}
    text = json.dumps(_codebook(study, described), indent=2, ensure_ascii=False)
    return f"{text}\n".encode("utf-8", "backslashreplace")


def _codebook(study: Study, files: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "study": study_head(study),
        "program": f"liquid-study {__version__}",
        "format": "CSV in UTF-8 with comma separators, decimal points and RFC 4180 quoting; an apostrophe precedes any "
        f"text that begins with {COMPUTED}",
        "missing": MISSING,
        "blinded": not study.revealed,
        "sealed_columns": [] if study.revealed else sorted(SEALED | sealed_interval_columns(study)),
        "key_opened": list(reveals_of(study.folder)),
        "doubts": [
            {"file": doubt.path.relative_to(study.folder).as_posix(), "what": doubt.what} for doubt in study.doubts
        ],
        "exclusions": [asdict(exclusion) for exclusion in study.exclusions],
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
        **({"levels": [_levels_entry(block) for block in study.levels]} if study.levels else {}),
        **({"questions": _question_entries(study)} if study.others.questions else {}),
        **({"scores": _score_entries(study)} if study.others.scores else {}),
        "measures": {
            "quartiles": QUARTILES,
            "agree_percent": f"percentage of valid answers at levels {AGREEMENT[0]} to {AGREEMENT[-1]}",
            "repeated": "the median of a participant's repeated answers to a statement is used; the detection "
            "threshold and the counts for each level are based on individual answers; for scores and numbers from "
            "other questions, hypotheses and the first page of the report use the mean, and the wide table the median",
            "counted": "main trials in completed sessions that are not excluded; if a trial was repeated, only its "
            "last attempt",
        },
        "files": files,
    }


def study_head(study: Study) -> dict[str, Any]:
    """Return the study's title, authors, licence, citation, and number of participants."""
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


def stated_credits(study: Study) -> dict[str, Any]:
    """Return the credits that the study states, as properties of schema.org."""
    stated = study.protocol.get("study", {}).get("credits") or {}
    return {name: stated[key] for key, name in _CREDITS.items() if stated.get(key)}


def _presentations(study: Study, block: Block) -> dict[str, Any]:
    """Return codebook entries: answers per participant, statement and setting, sessions, and replicates."""
    answers = study.answers(block)
    valid = answers[answers["response"].notna()]
    valid = valid.assign(column=valid["code"].map(block.columns))
    counts = valid.groupby(["participant", "column", "item"]).size()
    return {
        "answers_per_participant_setting_and_item": [int(counts.min()), int(counts.max())] if len(counts) else [0, 0],
        "sessions": sorted({int(number) for number in valid["session"]}),
        "replicates": [
            codes
            for place in sorted(set(block.columns.values()))
            if len(codes := [code for code, column in block.columns.items() if column == place]) > 1
        ],
    }


def _question_entries(study: Study) -> list[dict[str, Any]]:
    """Return the codebook entries of questions other than statements after trials."""
    return [
        {
            "form" if question.where.is_form else "block": question.where.id,
            "id": question.id,
            "kind": question.question.kind_id,
            "text": question.text,
            "short": question.short,
            **({"levels": question.levels} if question.levels else {}),
            **({"cannot_judge": question.cannot_judge} if question.cannot_judge else {}),
            **({"range": list(question.bounds)} if question.bounds else {}),
            **({"show_if": question.question.show_if.model_dump(mode="json")} if question.question.show_if else {}),
        }
        for question in study.others.questions
    ]


def _score_entries(study: Study) -> list[dict[str, Any]]:
    return [
        {
            "form" if score.where.is_form else "block": score.where.id,
            "name": score.name,
            "instrument": score.instrument,
            **score.score.model_dump(mode="json", exclude_defaults=True),
        }
        for score in study.others.scores
    ]


def _levels_entry(block: LevelBlock) -> dict[str, Any]:
    """Return the structure of a block of levels and, once the key is open, its varied quantity."""
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


def _describe_column(column: Column) -> dict[str, Any]:
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


def file_name(study: Study, table: ExportTable, ending: str) -> str:
    """Return the name of a table's file."""
    return f"study-{study.name}_description-{table.name}_data.{ending}"


def table_bytes(table: ExportTable) -> bytes:
    """Return a table as CSV (see `csv_bytes`)."""
    plain = table.frame.astype(object).where(table.frame.notna(), None)
    return csv_bytes(
        table.columns, (dict(zip(header(table.columns), row, strict=True)) for row in plain.itertuples(index=False))
    )


def _parquet_bytes(table: ExportTable) -> bytes:
    """Return a table as Parquet, with description and unit of every column; scale points are Int8."""
    import pyarrow as pa  # type: ignore[import-untyped]  # noqa: PLC0415 - takes long to load
    from pyarrow import parquet  # noqa: PLC0415

    types = {"integer": pa.int64(), "number": pa.float64(), "flag": pa.bool_()}
    fields = [
        pa.field(
            column.name,
            pa.int8()
            if column.kind == "integer" and (column.maximum or 128) < 128
            else types.get(column.kind, pa.string()),
            metadata={name: text for name in ("description", "unit") if (text := getattr(column, name))},
        )
        for column in table.columns
    ]
    target = io.BytesIO()
    frame = pa.Table.from_pandas(table.frame, schema=pa.schema(fields), preserve_index=False, safe=True)
    parquet.write_table(frame, target, compression="zstd")
    return target.getvalue()


def credit_lines(study: Study) -> tuple[str, str, str]:
    """Return lines with authors, licence and citation, even if the study does not state them."""
    stated = stated_credits(study)
    lines = (
        f"Authors: {', '.join(stated.get('author', [])) or 'not stated'}.",
        f"Licence: {stated.get('license', 'not stated; ask the authors before you use the data')}.",
        f"How to cite: {stated.get('citation', 'not stated; cite the study, its version and its authors')}.",
    )
    authors, licence, citation = (" ".join(line.split()) for line in lines)
    return authors, licence, citation
