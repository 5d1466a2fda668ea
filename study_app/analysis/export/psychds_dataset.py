"""An export as a Psych-DS folder of its own, to share: tables, report, script, and materials."""

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
    """The study materials on this machine by name, and descriptions of missing ones; footage is not read."""

    files: dict[str, bytes | FileCopy]
    missing: tuple[str, ...]


def materials(study: Study) -> Materials:
    """Return the study's file, its liquid files and its footage; nothing while the key is sealed."""
    if not study.revealed:
        return Materials({}, ())
    footage = _footage(study)
    found = find_study_file(study.name, set(study.participants["protocol_hash"]), footage)
    if found is None:
        return Materials({}, ("the study file", *(f"{name} (SHA-256 {footage[name]})" for name in footage)))
    file, source = found
    shown = {name: file.parent / name for name in footage if _is_inside(name)}
    there = {name: path for name, path in shown.items() if file_hash(path) == footage[name]}
    files: dict[str, bytes | FileCopy] = {
        file.name: source.file,
        **{name: text.encode() for name, text in source.liquids.items() if _is_inside(name)},
        **{name: FileCopy(path, footage[name]) for name, path in there.items()},
    }
    missing = [
        f"{name} (SHA-256 {digest}; {_why_missing(shown.get(name))})"
        for name, digest in footage.items()
        if name not in there
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
    """Return why footage is not shared; ``path`` is None if it lies outside the study's folder."""
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

    ``tables`` and ``columns`` are by file name; ``report`` has the files of the report, including its own copies of
    tables.
    """
    shown = {name: content for name, content in report.items() if name not in tables and name != _SCRIPT}
    description = _description(study, columns)
    own = materials(study)
    files: dict[str, bytes | FileCopy] = {
        "dataset_description.json": _json(description),
        "data/file_metadata.json": _json({key: description[key] for key in description if key != _VARIABLES}),
        **{f"data/{PurePosixPath(name).stem}.json": _sidecar(study, name, columns[name]) for name in tables},
        "README.md": _readme(study, tables, report, own.missing),
        "CHANGES.md": f"# Changes\n\n- {study.version}: exported by liquid-study {__version__}\n".encode(),
        ".psychds-ignore": b".psychds-ignore\n",
        **{f"data/{name}": content for name, content in tables.items()},
        "documentation/codebook.json": codebook_bytes(study, columns),
        "analysis/settings.json": _settings(study),
        **({f"analysis/{_SCRIPT}": report[_SCRIPT]} if _SCRIPT in report else {}),
        **{f"results/{name}": content for name, content in shown.items() if name != "codebook.json"},
        "materials/protocol.json": _json(study.protocol),
        **{f"materials/{name}": content for name, content in own.files.items()},
    }
    return {f"{FOLDER}/{name}": content for name, content in files.items()}


def _sidecar(study: Study, name: str, columns: tuple[Column, ...]) -> bytes:
    """Return the JSON sidecar that describes one table's columns, with authors and licence."""
    head = {"@context": _CONTEXT, "@type": "Dataset", "name": PurePosixPath(name).stem}
    return _json({**head, _VARIABLES: [column.variable for column in columns], **stated_credits(study)})


def _settings(study: Study) -> bytes:
    """Return the analysis settings (defaults if the study's file has none) and their study."""
    head = {"name": study.name, "version": study.version, **stated_credits(study)}
    decided = {name: value for name, value in asdict(study.decided).items() if name not in ("made", "changed")}
    return _json({**head, "analysis": decided | (study.protocol.get("analysis") or {})})


def variables(columns: Mapping[str, tuple[Column, ...]]) -> list[dict[str, Any]]:
    """Return every column of the tables once; ``columns`` are by file name.

    If tables describe a column of the same name differently, all descriptions are joined, and unit and range are those
    common to all tables.
    """
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for file, of_table in columns.items():
        table = file.partition("_description-")[2].partition("_")[0]
        for column in of_table:
            found.setdefault(column.name, {})[table] = column.variable
    return [_combine_descriptions(described) for described in found.values()]


def _combine_descriptions(described: Mapping[str, dict[str, Any]]) -> dict[str, Any]:
    """Return one description of a column from those of its tables."""
    first, *others = described.values()
    tables: dict[str, list[str]] = {}
    for table, one in described.items():
        tables.setdefault(one["description"], []).append(table)
    same = {name: value for name, value in first.items() if all(other.get(name) == value for other in others)}
    if len(tables) > 1:
        same["description"] = " ".join(f"In {', '.join(named)}: {words}" for words, named in tables.items())
    for name, widest in (("minValue", min), ("maxValue", max)):
        if all(name in one for one in described.values()):
            same[name] = widest(one[name] for one in described.values())
    return same


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
        _VARIABLES: variables(columns),
        **stated_credits(study),
    }


def _json(content: Any) -> bytes:
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
