"""Load a protocol file: return the validated protocol, or raise one ProtocolError that lists every problem."""

import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path as File
from typing import Any, Final, TypeVar

from pydantic import BaseModel, Field, ValidationError

from study_app.errors import Problem, ProtocolError
from study_app.haptics.model.device_dynamics import ASSUMED_TICKS
from study_app.haptics.model.scene import Liquid, RateHz, Scene, Withdrawn
from study_app.protocol.checks.consistency import check
from study_app.protocol.checks.designs import check_designs
from study_app.protocol.checks.force_limits import check_paced, check_returned_energy
from study_app.protocol.file_format.formats import format_fault, with_omitted_keys, with_scene_defaults
from study_app.protocol.file_format.json_schema import schema
from study_app.protocol.model import Format, HandForceN, Named, Protocol, SceneDefaults
from study_app.protocol.questionnaires import with_instruments
from study_app.protocol.source.document import Path, Places, entries, frozen
from study_app.protocol.source.files import (
    FOOTAGE_TABLE,
    TABLE,
    check_size,
    file_path_fault,
    is_footage,
    is_utf16,
    known_protocols,
    protocol_hash,
    shipped,
    source_bytes,
    without_byte_order_mark,
)
from study_app.protocol.source.problems import Fault, did_you_mean, faults_of
from study_app.protocol.source.table import Table

__all__ = [
    "is_scene_file",
    "known_protocols",
    "load",
    "load_scene",
    "load_scenes",
    "located_problems",
    "parse",
    "protocol_hash",
    "read_document",
    "shipped",
    "source_bytes",
    "validate_document",
]

_M = TypeVar("_M", bound=BaseModel)

_RENAME: Final = "rename the file, because its name must also be valid on Windows"
_SHOWN = 200  # greatest number of characters of a value that a message repeats
_LONG = re.compile(rf'(?<=")[^"]{{{_SHOWN + 1},}}(?=")|\S{{{_SHOWN + 1},}}')


class _SceneTable(SceneDefaults):
    """The scene of a file that holds no study: rate and force limit stand here, there is no device table."""

    rate_hz: RateHz = Field(default=1000, description="Nominal tick rate [Hz].")
    force_limit_n: HandForceN = Field(default=8, description="Maximum force on the hand [N].")


class SceneFile(Table):
    """A file of liquids without a study."""

    format: Format
    scene: _SceneTable = _SceneTable()
    liquids: Named[Liquid] = Field(min_length=1)


def load(name_or_path: str | File, *, delay_ticks: int = ASSUMED_TICKS) -> Protocol:
    """Return the protocol of a file or known name (`files.protocol_file`); raise ProtocolError with all its problems.

    Levels are checked for a device whose forces act ``delay_ticks`` ticks late.

    Examples
    --------
    >>> protocol = load("rek2024")
    >>> protocol.study.languages
    ('en', 'nl')
    >>> list(protocol.liquids)
    ['water', 'honey', 'light_oil', 'syrup']
    """
    return parse(source_bytes(name_or_path), str(name_or_path), delay_ticks=delay_ticks)


def parse(source: bytes, name: str, *, delay_ticks: int = ASSUMED_TICKS) -> Protocol:
    """Return the protocol in ``source``, like `load`; ``name`` is its name in error messages."""
    document, places = read_document(source, name)
    protocol, faults = validate_document(document, delay_ticks=delay_ticks)
    if protocol is None or faults:
        raise ProtocolError(name, located_problems(faults, places))
    return protocol


def validate_document(
    document: dict[str, Any], *, delay_ticks: int = ASSUMED_TICKS
) -> tuple[Protocol | None, list[Fault]]:
    """Return the protocol of a document read by `read_document`, and its faults.

    If the only faults are forces beyond a limit, the protocol is returned with them so that they can be displayed; with
    other faults it is None.
    """
    document, faults = _with_liquids_of_files(document)
    document, missing = _with_footage(document)
    if fault := format_fault(document):
        return None, [fault]
    document, unfilled = with_instruments(with_omitted_keys(document))
    faults += missing + unfilled
    broken = [fault.path[:2] for fault in faults]
    protocol, model_faults = _validate(Protocol, document)
    faults += _faults_outside(broken, model_faults)
    questionnaires = [path for path in broken if path[0] == "questionnaires"]
    valid = None if faults else protocol
    faults += _faults_outside(questionnaires, check(document, [fault.path for fault in faults], valid))
    if protocol is None or faults:
        return None, faults
    if faults := list(dict.fromkeys(check_designs(protocol))):
        return None, faults
    return protocol, [*check_paced(protocol, delay_ticks), *check_returned_energy(protocol)]


def _faults_outside(broken: Iterable[Path], faults: Iterable[Fault]) -> list[Fault]:
    """Return the faults outside the paths that already have one."""
    known = list(broken)
    return [fault for fault in faults if not any(fault.path[: len(path)] == path for path in known)]


def load_scene(name_or_path: str | File, liquid_id: str) -> Scene:
    """Return the scene of one liquid of a protocol, or of a file with only ``[scene]`` and ``[liquids.*]``.

    Raises ProtocolError with every problem of the file, or if the liquid is not in it.
    """
    scenes = load_scenes(name_or_path)
    if liquid_id not in scenes:
        fault = Fault(("liquids",), f'there is no liquid "{liquid_id}"', did_you_mean(liquid_id, scenes))
        name = str(name_or_path)
        _raise_faults(name, [fault], read_document(source_bytes(name_or_path), name)[1])
    return scenes[liquid_id]


def load_scenes(name_or_path: str | File) -> dict[str, Scene]:
    """Return a scene for each liquid of a protocol or scene file by name, including unused liquids."""
    name = str(name_or_path)
    source = source_bytes(name_or_path)
    document, places = read_document(source, name)
    if _holds_study(document):
        protocol = parse(source, name)
        return {liquid: protocol.scene_of(liquid) for liquid in protocol.liquids}
    file = SceneFile.model_validate(_completed_scene(document, name, places), strict=True)
    return {name: Scene(**dict(file.scene), liquids=(liquid,)) for name, liquid in file.liquids.items()}


def _completed_scene(document: dict[str, Any], name: str, places: Places) -> dict[str, Any]:
    """Return the completed document of a scene file; raise ProtocolError if it is invalid."""
    if fault := format_fault({"format": 1, **document}):
        _raise_faults(name, [fault], places)
    document = with_scene_defaults(document)
    _raise_faults(name, _validate(SceneFile, document)[1], places)
    return document


def is_scene_file(name_or_path: str | File) -> bool:
    """Return whether a file contains liquids and no other part of a study.

    Raises ProtocolError if it does not exist or is not TOML.
    """
    document, _ = read_document(source_bytes(name_or_path), str(name_or_path))
    return "liquids" in document and not _holds_study(document)


def _with_liquids_of_files(document: dict[str, Any]) -> tuple[dict[str, Any], list[Fault]]:
    """Return a study's document with the liquids of its liquid files, and the faults in these files."""
    liquids = document.get("liquids")
    if not isinstance(liquids, Mapping):
        return document, []
    from_files = {name for name, table in liquids.items() if isinstance(table, Mapping) and "file" in table}
    if not from_files:
        return document, []
    texts = document.get(TABLE, {})
    resolved: dict[str, Any] = dict(liquids)
    faults: list[Fault] = []
    for name in from_files:
        table, surplus_fault = liquids[name], Fault((), "belongs in the liquid file", kind="surplus")
        faults += [surplus_fault._replace(path=("liquids", name, key)) for key in table if key != "file"]
        try:
            resolved[name] = _liquid_of_file(table["file"], texts)
        except _LiquidFileFault as fault:
            message, hint = fault.args
            faults.append(Fault(("liquids", name, "file"), message, hint))
            resolved[name] = {"density_kg_m3": 1000.0}  # a placeholder, so that only the file is reported
    return {key: value for key, value in document.items() if key != TABLE} | {"liquids": resolved}, faults


def _with_footage(document: dict[str, Any]) -> tuple[dict[str, Any], list[Fault]]:
    """Return a study's document with the SHA-256 of each condition's footage, and faults for missing files."""
    stated_hashes = [
        Fault(path, "unknown key", "the program computes it")
        for path, _ in entries(document, "conditions.*.footage_sha256")
    ]
    footage_views = [
        (path, view) for path, view in entries(document, "conditions.*.view") if is_footage(view) and "." in view
    ]
    if stated_hashes or not footage_views:
        return document, stated_hashes
    hashes = document.get(FOOTAGE_TABLE, {})
    conditions = dict(document["conditions"])
    faults: list[Fault] = []
    for path, view in footage_views:
        if fault := file_path_fault(view):
            faults.append(Fault(path, fault, _RENAME))
        elif view in hashes:
            conditions[path[1]] = {**conditions[path[1]], "footage_sha256": hashes[view]}
        else:
            message = f'there is no file "{view}" in this folder'
            faults.append(Fault(path, message, "specify the path of a video file, relative to this file"))
    return {key: value for key, value in document.items() if key != FOOTAGE_TABLE} | {"conditions": conditions}, faults


class _LiquidFileFault(Exception):
    """A fault of a liquid file, with a hint."""


def _liquid_of_file(file: Any, texts: Mapping[str, str]) -> dict[str, Any]:
    """Return the only liquid of a liquid file as a study's table, with the file's ball."""
    if not isinstance(file, str):
        raise _LiquidFileFault("must be a string", "the path of a liquid file, relative to this file")
    if fault := file_path_fault(file):
        raise _LiquidFileFault(fault, _RENAME)
    if file not in texts:
        raise _LiquidFileFault(
            f'there is no UTF-8 text file "{file}" in this folder', "specify the path of the liquid file"
        )
    try:
        document, places = read_document(texts[file].encode(), file)
        document = _completed_scene(document, file, places)
    except ProtocolError as error:
        raise _LiquidFileFault(f"{file}: {error.problems[0]}", f"liquid-study check {file}") from error
    (first, *others) = document["liquids"].values()
    if others:
        raise _LiquidFileFault(f"{file} contains {len(others) + 1} liquids", "use a separate file for each liquid")
    body = document.get("scene", {}).get("body")
    return {**first, "body": body} if body else dict(first)


def _holds_study(document: Mapping[str, Any]) -> bool:
    return bool(document.keys() & (Protocol.model_fields.keys() - SceneFile.model_fields.keys()))


def read_document(source: bytes, name: str) -> tuple[dict[str, Any], Places]:
    """Return the tables of a TOML text, with arrays as tuples, and their lines (ProtocolError if it is invalid)."""
    check_size(source, name)
    if is_utf16(source):
        raise ProtocolError(name, (Problem("file", "is UTF-16 text", hint="save it as UTF-8"),))
    try:
        text = without_byte_order_mark(source).decode("utf-8").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        line = source.count(b"\n", 0, error.start) + 1
        raise ProtocolError(name, (Problem("file", "is not UTF-8 text", line, hint="save it as UTF-8"),)) from error
    try:
        document: dict[str, Any] = frozen(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:  # its message contains the position
        sentence, hint = re.sub(r" \(at .*\)$", "", str(error)), ""
        place = re.search(r"\(at line (\d+), column (\d+)\)", str(error))
        line, column = (int(place[1]), int(place[2])) if place else (text.count("\n") + 1, 1)
        if declared := re.fullmatch(r"Cannot declare (\(.*\)) twice", sentence):
            name = ".".join(re.findall(r"'([^']*)'", declared[1]))
            sentence, hint = f"[{name}] already exists", "combine the two tables, or rename one"
            if (first := _line_of_header(text, name)) is not None and first < line:
                sentence = f"{sentence} (line {first})"
        if sentence == "Cannot overwrite a value":
            key, equals, _ = text.splitlines()[line - 1].partition("=")
            sentence = f"the key {key.strip()} occurs twice in this table" if equals else "a key occurs twice"
        broken = Problem(
            "file", f"invalid TOML at column {column}: {sentence}", line, hint=hint or "see toml.io for the notation"
        )
        raise ProtocolError(name, (broken,)) from error
    except RecursionError as error:
        broken = Problem("file", "is nested too deeply", hint="use fewer brackets within brackets")
        raise ProtocolError(name, (broken,)) from error
    except ValueError as error:  # Python's limit of digits; the message does not contain the position
        raise ProtocolError(name, (Problem("file", "contains a whole number with more than 64 bits"),)) from error
    return document, Places(text)


def _line_of_header(text: str, name: str) -> int | None:
    """Return the line of the first header of a table in a TOML text, or None."""
    headers = ((number, line.partition("#")[0].strip()) for number, line in enumerate(text.splitlines(), start=1))
    found = (number for number, line in headers if re.sub(r"[\s\"']", "", line) in (f"[{name}]", f"[[{name}]]"))
    return next(found, None)


def _validate(model: type[_M], document: Mapping[str, Any]) -> tuple[_M | None, list[Fault]]:
    """Return the validated document, None if it is invalid, and the faults that its models found."""
    stated_ids = [path for section in ("liquids", "blocks") for path, _ in entries(document, f"{section}.*.id")]
    faults = [Fault(path, "unknown key", "the name of the table is its ID") for path in stated_ids]
    try:
        validated = model.model_validate(document, strict=True)
    except ValidationError as error:
        return None, faults + faults_of(error, document, schema(model))
    if isinstance(velocity := getattr(getattr(validated, "scene", None), "velocity", None), Withdrawn):
        message, hint = velocity.refusal
        return None, [*faults, Fault(("scene", "velocity", "kind"), message, hint)]
    return validated, faults


def located_problems(faults: Iterable[Fault], places: Places) -> tuple[Problem, ...]:
    """Return faults as problems with their lines, in the order of the lines."""

    def shorten(text: str) -> str:
        return _LONG.sub(lambda match: f"{match[0][:_SHOWN]}…", text)

    located = (fault.located(places) for fault in faults)
    short = [
        Problem(shorten(problem.place), shorten(problem.message), problem.line, hint=shorten(problem.hint))
        for problem in located
    ]
    return tuple(sorted(short, key=lambda problem: problem.line or 0))


def _raise_faults(name: str, faults: list[Fault], places: Places) -> None:
    if faults:
        raise ProtocolError(name, located_problems(faults, places))
