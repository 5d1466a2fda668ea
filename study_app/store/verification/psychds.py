"""The published rules of Psych-DS (schema 1.5), as far as they can be checked without the network.

Errors make a folder no Psych-DS dataset; warnings are what the schema recommends. The codes are the schema's. Of
schema.org itself only what the rules name is known: types of objects are looked at, their properties are not.
"""

import csv
import io
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import Any, TypeAlias

from study_app.store.atomic import cannot_read, parse_json, paths_in, read_regular

Metadata: TypeAlias = Mapping[str, Any]

DATA_FILE = re.compile(r"([a-z]+-[a-zA-Z0-9]+)(_[a-z]+-[a-zA-Z0-9]+)*_data\.csv")
KEYWORDS = frozenset({"study", "site", "subject", "session", "task", "condition", "trial", "stimulus", "description"})
REQUIRED = ("name", "description", "variableMeasured")
RECOMMENDED = ("author", "citation", "license", "funder", "url", "identifier", "privacyPolicy", "keywords")
RECOMMENDED_FOLDERS = ("analysis", "results", "materials", "documentation")

_DESCRIPTION = "dataset_description.json"
_IGNORE = ".psychds-ignore"
_IGNORED = (
    ".git*", "*.DS_Store", ".datalad/", ".reproman/", "sourcedata/", "code/", "stimuli/", "materials/",
    "results/", "products/", "analysis/", "documentation/", "log/",
)  # fmt: skip
_SCHEMA_ORG = re.compile(r"https?://(www\.)?schema\.org/?")


@dataclass(frozen=True, slots=True)
class Issue:
    """A rule that is not kept: its code, where, and what is wrong."""

    code: str
    place: str
    message: str

    def __str__(self) -> str:
        return f"{self.place}: {self.message} ({self.code})"


@dataclass(frozen=True, slots=True)
class PsychDs:
    """What a validator says of a folder."""

    errors: tuple[Issue, ...]
    warnings: tuple[Issue, ...]


def validate(folder: Path) -> PsychDs:
    """Check ``folder`` against the rules."""
    files = _files(folder)
    errors: list[Issue] = []
    metadata = _description(folder, errors)
    errors += [
        Issue("JSON_INVALID", _name(folder, path), "is not JSON in UTF-8")
        for path in files
        if path.suffix == ".json" and path != folder / _DESCRIPTION and _json(path) is None
    ]
    tables = [path for path in files if _is_table(path.relative_to(folder))]
    if not (folder / "data").is_dir():
        errors.append(Issue("MISSING_DATA_DIRECTORY", ".", "no folder data"))
    elif not tables:
        errors.append(Issue("MISSING_DATAFILE", "data", "no file named ..._data.csv"))
    measured: set[str] = set()
    for path in tables:
        errors += _table_errors(folder, path, metadata, measured)
    listed = _variables(metadata)
    if tables and (missing := sorted(listed - measured)):
        names = ", ".join(missing)
        errors.append(
            Issue("VARIABLE_MISSING_FROM_CSV_COLUMNS", _DESCRIPTION, (f"{names}: not in the header of any file"))
        )
    return PsychDs(tuple(errors), tuple(_warnings(folder, files, metadata)))


def _description(folder: Path, errors: list[Issue]) -> Metadata:
    """Return the dataset's description, empty where it is none, and add what is wrong with it."""
    path = folder / _DESCRIPTION
    if not path.is_file():
        errors.append(Issue("MISSING_DATASET_DESCRIPTION", ".", f"no {_DESCRIPTION}"))
        return {}
    metadata = _json(path)
    if not isinstance(metadata, dict):
        errors.append(Issue("INVALID_JSON_FORMATTING", _DESCRIPTION, "is not a JSON object"))
        return {}
    if not _SCHEMA_ORG.fullmatch(str(metadata.get("@context", ""))):
        message = f"@context is {metadata.get('@context')!r}, not https://schema.org/"
        errors.append(Issue("INVALID_JSONLD_FORMATTING", _DESCRIPTION, message))
    kind = metadata.get("@type", metadata.get("type"))
    if kind is None:
        errors.append(Issue("MISSING_DATASET_TYPE", _DESCRIPTION, "no @type"))
    elif _SCHEMA_ORG.sub("", str(kind)) != "Dataset":
        errors.append(Issue("INCORRECT_DATASET_TYPE", _DESCRIPTION, f"@type is {kind!r}, not Dataset"))
    missing = (name for name in REQUIRED if not metadata.get(name))
    errors += [Issue("JSON_KEY_REQUIRED", _DESCRIPTION, f"no {name}") for name in missing]
    return metadata


def _table_errors(folder: Path, path: Path, metadata: Metadata, measured: set[str]) -> Iterator[Issue]:
    """Yield what is wrong with one data file, and add its header to ``measured``."""
    name = _name(folder, path)
    if not DATA_FILE.fullmatch(path.name):
        yield Issue("FILENAME_KEYWORD_FORMATTING_ERROR", name, "the name is not key-value_key-value_data.csv")
    try:
        header, *rows = list(csv.reader(io.StringIO(_content(path).decode("utf-8"), newline=""), strict=True)) or [[]]
    except (UnicodeDecodeError, csv.Error) as error:
        yield Issue("CSV_FORMATTING_ERROR", name, f"is not CSV in UTF-8 ({error})")
        return
    measured.update(header)
    if not any(header):
        yield Issue("CSV_HEADER_MISSING", name, "no header")
        return
    if repeated := [column for column, count in Counter(header).items() if count > 1]:
        yield Issue("CSV_HEADER_REPEATED", name, f"{', '.join(repeated)}: more than once in the header")
    for number, row in enumerate(rows, start=2):
        if len(row) != len(header):
            message = f"row {number} has {len(row)} cells under {len(header)} headers"
            yield Issue("CSV_HEADER_LENGTH_MISMATCH", name, message)
            return
    if "row_id" in header and len({row[header.index("row_id")] for row in rows}) < len(rows):
        yield Issue("ROWID_VALUES_NOT_UNIQUE", name, "values of row_id come more than once")
    described = _variables(_metadata_of(folder, path, metadata))
    if unknown := [column for column in header if column not in described]:
        yield Issue("CSV_COLUMN_MISSING_FROM_METADATA", name, f"{', '.join(unknown)}: not in variableMeasured")


def _metadata_of(folder: Path, path: Path, metadata: Metadata) -> Metadata:
    """Return what describes one file: its own sidecar, else the nearest file_metadata.json, else the dataset's."""
    above = [parent for parent in path.parents if parent.is_relative_to(folder / "data")]
    for place in (path.with_suffix(".json"), *(parent / "file_metadata.json" for parent in above)):
        if place.is_file() and isinstance(own := _json(place), dict) and "variableMeasured" in own:
            return own
    return metadata


def _variables(metadata: Metadata) -> set[str]:
    measured = metadata.get("variableMeasured", ())
    if not isinstance(measured, list):
        return set()
    return {str(one.get("name", "") if isinstance(one, dict) else one) for one in measured} - {""}


def _warnings(folder: Path, files: list[Path], metadata: Metadata) -> Iterator[Issue]:
    for name in ("README", "CHANGES"):
        if not any((folder / f"{name}{ending}").is_file() for ending in (".md", ".txt")):
            yield Issue(f"MISSING_{name}_DOC", ".", f"no {name}.md")
    for name in RECOMMENDED_FOLDERS:
        if not (folder / name).is_dir():
            yield Issue(f"MISSING_{name.upper()}_DIRECTORY", ".", f"no folder {name}")
    if not (folder / _IGNORE).is_file():
        yield Issue("MISSING_PSYCHDSIGNORE", ".", f"no {_IGNORE}")
    if missing := [name for name in RECOMMENDED if name not in metadata]:
        yield Issue("JSON_KEY_RECOMMENDED", _DESCRIPTION, f"no {', '.join(missing)}")
    measured = metadata.get("variableMeasured", ())
    if any(isinstance(one, dict) and "@type" not in one for one in (measured if isinstance(measured, list) else ())):
        yield Issue("OBJECT_TYPE_MISSING", _DESCRIPTION, "variableMeasured holds objects without @type")
    yield from _file_warnings(folder, files)


def _file_warnings(folder: Path, files: list[Path]) -> Iterator[Issue]:
    unchecked: list[str] = []
    for path in files:
        name, inside = _name(folder, path), path.relative_to(folder)
        if path.stat().st_size == 0:
            yield Issue("FILE_EMPTY", name, "is empty")
        if path.name == _DESCRIPTION and len(inside.parts) > 1:
            yield Issue("WRONG_METADATA_LOCATION", name, "the dataset's description belongs in the top folder")
        if _is_table(inside):
            if DATA_FILE.fullmatch(path.name) and (unofficial := sorted(_keys(path.name) - KEYWORDS)):
                yield Issue("FILENAME_UNOFFICIAL_KEYWORD_WARNING", name, f"{', '.join(unofficial)}: not official")
        elif not _is_known(inside):
            unchecked.append(name)
    if unchecked:
        others = f" and {len(unchecked) - 1} more" if len(unchecked) > 1 else ""
        yield Issue("FILE_NOT_CHECKED", unchecked[0], f"not covered by Psych-DS{others}")


def _is_table(inside: Path) -> bool:
    return len(inside.parts) > 1 and inside.parts[0] == "data" and inside.name.endswith("_data.csv")


def _is_known(inside: Path) -> bool:
    stem = inside.name.partition(".")[0]
    at_top = len(inside.parts) == 1 and stem in ("dataset_description", "README", "CHANGES")
    return at_top or inside.name == "file_metadata.json" or inside.name.endswith("_data.json")


def _keys(name: str) -> set[str]:
    return {pair.partition("-")[0] for pair in name.removesuffix("_data.csv").split("_")}


def _files(folder: Path) -> list[Path]:
    """Return the files that count: those that neither the rules nor the folder's own list leave out."""
    ignore = folder / _IGNORE
    own = _content(ignore).decode("utf-8", "replace").splitlines() if ignore.is_file() else []
    patterns = [line.strip() for line in (*_IGNORED, *own, _IGNORE) if line.strip() and not line.startswith("#")]
    found = (path for path in paths_in(folder) if path.is_file())
    return [path for path in found if not _ignored(path.relative_to(folder), patterns)]


def _ignored(inside: Path, patterns: list[str]) -> bool:
    """Return whether a pattern (of those of .gitignore: a name, or a folder with its slash) leaves the file out."""
    for pattern in patterns:
        parts = inside.parts[:-1] if pattern.endswith("/") else inside.parts
        if any(fnmatch(part, pattern.rstrip("/")) for part in parts):
            return True
    return False


def _name(folder: Path, path: Path) -> str:
    return path.relative_to(folder).as_posix()


def _json(path: Path) -> Any:
    """Return the file's value, None where it is not JSON in UTF-8."""
    try:
        return parse_json(_content(path).decode("utf-8"))
    except ValueError:
        return None


def _content(path: Path) -> bytes:
    try:
        return read_regular(path)
    except OSError as error:
        raise cannot_read(path, error) from error
