"""Protocol files, and the files to which a study refers: liquid files and footage, both in the study's folder.

``[liquids.syrup] file = "syrup.toml"`` refers to a scene file with one liquid, ``[conditions.seen] view =
"waves.mp4"`` to a video. A study's source is its file, followed by the SHA-256 of its footage in a table
``[footage_files]``, and by its liquid files as texts in a last table ``[liquid_files]``. So the source's hash covers
everything that is presented, and the lines of the study's own file keep their numbers. A file without such references
is its own source.
"""

from __future__ import annotations

import codecs
import hashlib
import json
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from pathlib import Path, PureWindowsPath
from types import MappingProxyType
from typing import Final, NamedTuple

from study_app.errors import Problem, ProtocolError
from study_app.ids import file_name_fault
from study_app.protocol.source.problems import did_you_mean
from study_app.workspace import workspace

TABLE: Final = "liquid_files"
FOOTAGE_TABLE: Final = "footage_files"
_FOOTAGE_HEADER: Final = f"\n\n# The SHA-256 of the footage of this study.\n[{FOOTAGE_TABLE}]\n".encode()
_HEADER: Final = f"\n\n# The liquid files of this study, as they were read.\n[{TABLE}]\n".encode()
_MAX_BYTES: Final = 1_000_000
"""Greatest size of a study with its liquid files [bytes]; a study with 200 statements has 50,000."""
_VIEWS_WITHOUT_FILE: Final = ("tank", "camera")
"""Views of a condition that are not files."""


def without_byte_order_mark(content: bytes) -> bytes:
    """Return a file's content without the byte order mark that some editors write before UTF-8."""
    return content.removeprefix(codecs.BOM_UTF8)


def is_utf16(content: bytes) -> bool:
    """Return whether a file is UTF-16 text: it starts with a byte order mark or with a letter and a null byte."""
    return content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) or b"\0" in content[:2]


class StudySource(NamedTuple):
    """A study's file, and by name the texts of its liquid files and the SHA-256 of its footage."""

    file: bytes
    liquids: Mapping[str, str] = MappingProxyType({})
    footage: Mapping[str, str] = MappingProxyType({})

    @classmethod
    def split(cls, source: bytes) -> StudySource:
        """Return the parts of a source."""
        without_liquids, liquids = _split(source, _HEADER)
        file, footage = _split(without_liquids, _FOOTAGE_HEADER)
        return cls(file, liquids, footage)

    def with_liquids(self, text_of: Callable[[str], str | None]) -> StudySource:
        """Return the source with other liquid files; ``text_of`` returns the text of a file, None if it is missing."""
        names = _section_texts(self.file, "liquids", "file")
        return self._replace(liquids={name: text for name in names if (text := text_of(name)) is not None})

    @property
    def content(self) -> bytes:
        """The source as bytes: the study's file, followed by the tables of footage and liquid files."""
        return self.file + _table_bytes(_FOOTAGE_HEADER, self.footage) + _table_bytes(_HEADER, self.liquids)


def with_liquid_files(study: bytes, folder: Path) -> bytes:
    """Return a study's source: its file without a byte order mark, and its footage and liquid files in ``folder``.

    Unreadable files are omitted; `load.parse` reports them. A file that is already a source is returned unchanged.
    """
    study = without_byte_order_mark(study)
    if _HEADER in study or _FOOTAGE_HEADER in study:
        return study
    hashes = {name: digest for name in _footage_names(study) if (digest := file_hash(folder / name)) is not None}
    return StudySource(study, footage=hashes).with_liquids(lambda name: _text_of_file(folder / name)).content


def _split(source: bytes, header: bytes) -> tuple[bytes, dict[str, str]]:
    """Return the bytes before a header, and the table after it."""
    before, separator, table = source.rpartition(header)
    return (before, tomllib.loads(table.decode())) if separator else (source, {})


def _table_bytes(header: bytes, texts: Mapping[str, str]) -> bytes:
    def quoted(text: str) -> str:
        return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")

    rows = "".join(f"{quoted(name)} = {quoted(text)}\n" for name, text in texts.items())
    return header + rows.encode() if texts else b""


def file_path_fault(path: str) -> str:
    """Return the reason why a file path is not valid on Windows, or ""."""
    names = (part for part in PureWindowsPath(path).parts if part != PureWindowsPath(path).anchor)
    return next((f'"{name}" {fault}' for name in names if (fault := file_name_fault(name))), "")


def _footage_names(study: bytes) -> list[str]:
    """Return the sorted names of a study's footage; empty if it is not TOML (`load.parse` reports it)."""
    return [name for name in _section_texts(study, "conditions", "view") if is_footage(name)]


def is_footage(view: object) -> bool:
    """Return whether a condition's view is a footage file."""
    return isinstance(view, str) and view not in _VIEWS_WITHOUT_FILE


def file_hash(path: Path) -> str | None:
    """Return the SHA-256 of a file in hexadecimal; None if it cannot be read."""
    try:
        status = path.stat()
        return _hash_of_file(path, status.st_size, status.st_mtime_ns) if path.is_file() else None
    except (OSError, ValueError):
        return None


@lru_cache(maxsize=64)
def _hash_of_file(path: Path, size: int, changed_ns: int) -> str:
    """Return the SHA-256 of a file; ``size`` and ``changed_ns`` are cache keys that change with the file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _section_texts(study: bytes, section: str, key: str) -> list[str]:
    """Return the distinct texts of a key in a section's tables, sorted; empty if the study is not TOML."""
    if not re.search(rf"""\b{key}["']?[ \t]*=""".encode(), study):
        return []
    try:
        tables = tomllib.loads(study.decode()).get(section)
    except (ValueError, RecursionError):
        return []
    values = (
        (table.get(key) for table in tables.values() if isinstance(table, Mapping))
        if isinstance(tables, Mapping)
        else ()
    )
    return sorted({value for value in values if isinstance(value, str)})


def _text_of_file(path: Path) -> str | None:
    try:
        return (
            without_byte_order_mark(path.read_bytes()).decode() if path.is_file() else None
        )  # never a device or a pipe, which may not end
    except (OSError, ValueError):
        return None


_PACKAGE = Path(__file__).resolve().parents[2]
# The names are listed, because the workspace may be a checkout, whose protocols folder also contains new studies.
_SHIPPED = (
    "delaydetect",
    "delayjnd",
    "demo",
    "forcedelay",
    "physical2",
    "physical_liquids",
    "rek2024",
    "slime",
    "thickness",
    "viscosityjnd",
)


def _shipped_folder() -> Path:
    """Return the protocols' folder in an installed package, or next to the package in a checkout."""
    packaged = _PACKAGE / "protocols"
    return packaged if packaged.is_dir() else _PACKAGE.parent / "protocols"


def shipped() -> dict[str, Path]:
    """Return the files of the shipped protocols by name, sorted."""
    return {name: file for name in _SHIPPED if (file := shipped_file(name)).is_file()}


def shipped_file(name: str) -> Path:
    """Return the file of a shipped protocol, even if the workspace has one with the same name."""
    return _shipped_folder() / f"{name}.toml"


def shipped_studies() -> tuple[Path, ...]:
    """Return the files of all shipped studies: protocols and the designer's templates."""
    templates = (_PACKAGE / "designer" / "templates").glob("*.toml")
    return (*shipped().values(), *sorted(templates))


def known_protocols() -> tuple[str, ...]:
    """Return the names of the workspace's protocols, then of shipped ones."""
    return tuple(dict.fromkeys((*(path.stem for path in workspace().own_protocols()), *shipped())))


def protocol_file(name_or_path: str | Path) -> Path:
    """Return the file of a protocol; raise ProtocolError if there is none."""
    path = Path(name_or_path)
    if path.is_file():
        return path
    if path.name == str(name_or_path) and path.suffix != ".toml":
        for folder in (workspace().protocols, _shipped_folder()):
            if (file := folder / f"{path.name}.toml").is_file():
                return file
        raise _not_found(
            name_or_path, "there is no protocol with this name", did_you_mean(path.name, known_protocols())
        )
    if path.is_dir():
        raise _not_found(name_or_path, "is a folder, not a protocol file", "specify one of the .toml files in it")
    if path.exists():
        raise _not_found(name_or_path, "is a pipe or a device, not a protocol file", "specify a .toml file")
    raise _not_found(
        name_or_path, "there is no such file", f"specify a file, or one of these names: {', '.join(shipped())}"
    )


def _not_found(name_or_path: str | Path, message: str, hint: str) -> ProtocolError:
    return ProtocolError(str(name_or_path), (Problem("file", message, hint=hint),))


def source_bytes(name_or_path: str | Path) -> bytes:
    """Return a protocol's file followed by its liquid files (`with_liquid_files`)."""
    path = protocol_file(name_or_path)
    try:
        source = path.read_bytes()
        check_size(source, str(name_or_path))
        return with_liquid_files(source, path.parent)
    except OSError as error:
        raise _not_found(name_or_path, f"cannot be read: {error.strerror}", "check its permissions") from error


def find_study_file(study: str, hashes: Iterable[str], footage: Mapping[str, str]) -> tuple[Path, StudySource] | None:
    """Return file and source of the known protocol with this study name and one of these hashes, or None.

    ``footage`` has the SHA-256 of the study's footage by name, because the footage may be elsewhere.
    """
    for name in known_protocols():
        try:
            file = protocol_file(name)
            if not _has_study_name(study, file):  # the footage of other studies, which may be large, is not hashed
                continue
            source = StudySource.split(source_bytes(name))
        except ProtocolError:  # an unreadable file cannot be shared, and may be of another study
            continue
        content = source._replace(footage=footage).content
        if any(has_hash(content, digest) for digest in hashes):
            return file, source
    return None


def _has_study_name(study: str, file: Path) -> bool:
    """Return whether a protocol file has this study name."""
    try:
        study_table = tomllib.loads(without_byte_order_mark(file.read_bytes()).decode()).get("study")
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(study_table, dict) and study_table.get("name") == study


def check_size(source: bytes, name: str) -> None:
    """Raise ProtocolError if a source is too large to be a study, before it is parsed."""
    if len(source) > _MAX_BYTES:
        size = f"is {len(source) / 1e6:.1f} MB in size, but a study file may be at most {_MAX_BYTES / 1e6:g} MB"
        raise ProtocolError(name, (Problem("file", size, hint="check that it is a study file"),))


def protocol_hash(source: bytes) -> str:
    """Return the SHA-256 of a protocol's source in hexadecimal: its file and liquid files, with LF line endings."""
    return hashlib.sha256(_with_line_feeds(source)).hexdigest()


def has_hash(source: bytes, digest: str) -> bool:
    """Return whether a source has this hash with any line endings, since earlier versions did not normalise them."""
    unix = _with_line_feeds(source)
    return digest in {hashlib.sha256(text).hexdigest() for text in (source, unix, unix.replace(b"\n", b"\r\n"))}


def _with_line_feeds(source: bytes) -> bytes:
    return source.replace(b"\r\n", b"\n")
