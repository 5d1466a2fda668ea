"""An export as a separate Psych-DS folder to share: tables, report, script, and materials."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path, PurePosixPath
from typing import Any, Final, NamedTuple

from study_app import __version__
from study_app.analysis.data.study_tables import Study
from study_app.analysis.export.table_files import codebook_bytes, credit_lines, stated_credits
from study_app.number_text import counted
from study_app.protocol.blocks import display_language
from study_app.protocol.source import file_hash, find_study_file, text_in
from study_app.store.blinded import revealed_key
from study_app.store.files import Column, FileCopy, open_regular, system_message
from study_app.store.merged import read_merged


class Materials(NamedTuple):
    """The study materials on this computer by name, and descriptions of missing ones; footage is copied later."""

    files: dict[str, bytes | FileCopy]
    missing: tuple[str, ...]


def materials(study: Study) -> Materials:
    """Return the study's file, its liquid files and its footage; nothing while the key is sealed."""
    if not study.revealed:
        return Materials({}, ())
    footage = _footage(study)
    study_file = find_study_file(study.name, set(study.participants["protocol_hash"]), footage)
    if study_file is None:
        return Materials({}, ("the study file", *(f"{name} (SHA-256 {footage[name]})" for name in footage)))
    file, source = study_file
    inside = {name: file.parent / name for name in footage if _is_inside(name)}
    matching = {name: path for name, path in inside.items() if file_hash(path) == footage[name]}
    files: dict[str, bytes | FileCopy] = {
        file.name: source.file,
        **{name: text.encode() for name, text in source.liquids.items() if _is_inside(name)},
        **{name: FileCopy(path, footage[name]) for name, path in matching.items()},
    }
    missing = [
        f"{name} (SHA-256 {digest}; {_why_missing(inside.get(name))})"
        for name, digest in footage.items()
        if name not in matching
    ]
    return Materials(files, tuple(missing))


def _footage(study: Study) -> dict[str, str]:
    """Return the SHA-256 of the study's footage by name, from its opened key."""
    merged = read_merged(study.folder)
    key = revealed_key(study.folder if merged is None else merged.folder(merged.names[0]))
    conditions = () if key is None else key.tables["conditions"].values()
    return dict(
        sorted(
            (condition["view"], condition["footage_sha256"])
            for condition in conditions
            if condition.get("footage_sha256")
        )
    )


def _is_inside(name: str) -> bool:
    """Return whether a referenced file is inside the study's folder."""
    path = PurePosixPath(name)
    return ".." not in path.parts and not path.is_absolute()


def _why_missing(path: Path | None) -> str:
    """Return the reason why footage is not shared; ``path`` is None if it is outside the study's folder."""
    if path is None:
        return "the file is outside the study's folder"
    try:
        with open_regular(path, largest_bytes=math.inf) as file:
            file.read(1)
    except (OSError, ValueError) as error:
        return f"the file cannot be read: {system_message(error) if isinstance(error, OSError) else error}"
    return "the file with this name has a different SHA-256"


FOLDER: Final = "psych-ds"
_KEYWORDS: Final = ("haptics", "psychophysics", "liquids", "Likert scale")
_SCRIPT: Final = "report.R"
_CONTEXT: Final = "https://schema.org/"
_VARIABLES: Final = "variableMeasured"


def dataset_files(
    study: Study, tables: Mapping[str, bytes], columns: Mapping[str, tuple[Column, ...]], report: Mapping[str, bytes]
) -> dict[str, bytes | FileCopy]:
    """Return the dataset's files by path.

    The keys of ``tables`` and ``columns`` are file names; ``report`` has the files of the report, including its copies
    of tables.
    """
    report_files = {name: content for name, content in report.items() if name not in tables and name != _SCRIPT}
    description = _description(study, columns)
    study_materials = materials(study)
    files: dict[str, bytes | FileCopy] = {
        "dataset_description.json": _json_bytes(description),
        "data/file_metadata.json": _json_bytes({key: description[key] for key in description if key != _VARIABLES}),
        **{f"data/{PurePosixPath(name).stem}.json": _sidecar(study, name, columns[name]) for name in tables},
        "README.md": _readme(study, tables, report, study_materials.missing),
        "CHANGES.md": f"# Changes\n\n- {study.version}: exported by liquid-study {__version__}\n".encode(),
        ".psychds-ignore": b".psychds-ignore\n",
        **{f"data/{name}": content for name, content in tables.items()},
        "documentation/codebook.json": codebook_bytes(study, columns),
        "analysis/settings.json": _settings(study),
        **({f"analysis/{_SCRIPT}": report[_SCRIPT]} if _SCRIPT in report else {}),
        **{f"results/{name}": content for name, content in report_files.items() if name != "codebook.json"},
        "materials/protocol.json": _json_bytes(study.protocol),
        **{f"materials/{name}": content for name, content in study_materials.files.items()},
    }
    return {f"{FOLDER}/{name}": content for name, content in files.items()}


def _sidecar(study: Study, name: str, columns: tuple[Column, ...]) -> bytes:
    """Return the JSON sidecar that describes one table's columns, with authors and licence."""
    head = {"@context": _CONTEXT, "@type": "Dataset", "name": PurePosixPath(name).stem}
    return _json_bytes({**head, _VARIABLES: [column.variable for column in columns], **stated_credits(study)})


def _settings(study: Study) -> bytes:
    """Return the analysis settings (defaults if the study's file has none) and their study."""
    head = {"name": study.name, "version": study.version, **stated_credits(study)}
    decided = {name: value for name, value in asdict(study.decided).items() if name not in ("made", "changed")}
    return _json_bytes({**head, "analysis": decided | (study.protocol.get("analysis") or {})})


def merged_variables(columns: Mapping[str, tuple[Column, ...]]) -> list[dict[str, Any]]:
    """Return one description for each column name; ``columns`` has the columns of each file.

    If tables describe a column differently, the descriptions are joined, and only properties that all tables share are
    kept, with the widest range.
    """
    by_name: dict[str, dict[str, dict[str, Any]]] = {}
    for file, table_columns in columns.items():
        table = file.partition("_description-")[2].partition("_")[0]
        for column in table_columns:
            by_name.setdefault(column.name, {})[table] = column.variable
    return [_combine_descriptions(described) for described in by_name.values()]


def _combine_descriptions(described: Mapping[str, dict[str, Any]]) -> dict[str, Any]:
    """Return one description of a column from those of its tables."""
    first, *others = described.values()
    tables: dict[str, list[str]] = {}
    for table, variable in described.items():
        tables.setdefault(variable["description"], []).append(table)
    combined = {name: value for name, value in first.items() if all(other.get(name) == value for other in others)}
    if len(tables) > 1:
        combined["description"] = " ".join(
            f"In {', '.join(table_names)}: {description}" for description, table_names in tables.items()
        )
    for name, widest in (("minValue", min), ("maxValue", max)):
        if all(name in variable for variable in described.values()):
            combined[name] = widest(variable[name] for variable in described.values())
    return combined


def _description(study: Study, columns: Mapping[str, tuple[Column, ...]]) -> dict[str, Any]:
    """Return the dataset's description."""
    head = study.protocol.get("study", {})
    description = head.get("description") or study.title
    return {
        "@context": _CONTEXT,
        "@type": "Dataset",
        "name": study.name,
        "alternateName": study.title,
        "description": text_in(description, display_language(study.protocol))
        if isinstance(description, Mapping)
        else str(description).strip(),
        "version": study.version,
        "keywords": [*_KEYWORDS, *(["simulated"] if study.simulated else [])],
        _VARIABLES: merged_variables(columns),
        **stated_credits(study),
    }


def _json_bytes(content: Any) -> bytes:
    return f"{json.dumps(content, indent=2, ensure_ascii=False)}\n".encode()


def _readme(study: Study, tables: Mapping[str, bytes], report: Mapping[str, bytes], missing: Sequence[str]) -> bytes:
    simulated = "**All participants are simulated.** " if study.simulated else ""
    blinded = (
        "Conditions are identified by their names."
        if study.revealed
        else ("Conditions appear as codes, because the study is blinded.")
    )
    script = f"; `Rscript analysis/{_SCRIPT} data results` recomputes its main numbers" if _SCRIPT in report else ""
    lines = [
        f"# {study.title}",
        "",
        f"{simulated}This Psych-DS dataset contains data from {counted(study.n, 'participant')}. {blinded} Missing "
        "values are marked `n/a`. Statements, levels and exclusions are in `documentation/codebook.json`; the "
        "texts used in the study are in `materials`.",
        "",
        *(f"- `data/{name}`" for name in tables),
        *([f"- `results/report.html`: the report{script}"] if "report.html" in report else []),
        *(["", f"Add the files that are missing from `materials`: {', '.join(missing)}."] if missing else []),
        "",
        *credit_lines(study),
    ]
    return ("\n".join(lines) + "\n").encode()
