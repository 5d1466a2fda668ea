"""An export as a Psych-DS folder of its own, to share: its tables under ``data``, every column described both ways."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Final

from study_app import __version__
from study_app.analysis.export.codebook import codebook_bytes
from study_app.analysis.tables.compared_blocks import spoken, text_in
from study_app.analysis.tables.study import Study
from study_app.store.tables.cells import variable
from study_app.store.tables.column import Column

FOLDER: Final = "psych-ds"
KEYWORDS: Final = ("haptics", "psychophysics", "liquids", "Likert scale")


def dataset_files(
    study: Study, tables: Mapping[str, bytes], columns: Mapping[str, tuple[Column, ...]]
) -> dict[str, bytes]:
    """Return the folder's files by their paths; ``tables`` and ``columns`` go by the names of the tables' files."""
    return {
        f"{FOLDER}/dataset_description.json": _description(study, columns),
        f"{FOLDER}/README.md": _readme(study, tables),
        f"{FOLDER}/CHANGES.md": f"# Changes\n\n- {study.version}: exported by liquid-study {__version__}\n".encode(),
        f"{FOLDER}/.psychds-ignore": b".psychds-ignore\n",
        **{f"{FOLDER}/data/{name}": content for name, content in tables.items()},
        f"{FOLDER}/documentation/codebook.json": codebook_bytes(study, columns),
    }


def _description(study: Study, columns: Mapping[str, tuple[Column, ...]]) -> bytes:
    """Return the dataset's description; a column that several tables share is described once."""
    every = {column.name: column for of_table in columns.values() for column in of_table}
    head = study.protocol.get("study", {})
    description = head.get("description") or study.title
    content = {
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": study.name,
        "alternateName": study.title,
        "description": text_in(description, spoken(study.protocol))
        if isinstance(description, Mapping)
        else str(description).strip(),
        "version": study.version,
        "keywords": [*KEYWORDS, *(["simulated"] if study.simulated else [])],
        "variableMeasured": [variable(column) for column in every.values()],
    }
    return f"{json.dumps(content, indent=2, ensure_ascii=False)}\n".encode()


def _readme(study: Study, tables: Mapping[str, bytes]) -> bytes:
    simulated = "**All participants are simulated.** " if study.simulated else ""
    blinded = "Settings are named." if study.revealed else "Settings are codes: the key is sealed."
    lines = [
        f"# {study.title}",
        "",
        f"{simulated}{study.n} participants. {blinded} A Psych-DS dataset; `n/a` is a missing cell. Statements, levels "
        "and exclusions are in `documentation/codebook.json`.",
        "",
        *(f"- `data/{name}`" for name in tables),
    ]
    return ("\n".join(lines) + "\n").encode()
