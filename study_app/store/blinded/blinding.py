"""The sealed key from codes to conditions, and the encryption of blinded fields until the key is opened.

``blinding/key.sealed`` is base64 of a JSON object with the codes, the conditions' and liquids' tables and a 256-bit
nonce. It is drawn once per study, and opened only with a name and a reason. It is encoded, not encrypted: that prevents
accidental reading, and its SHA-256 in every receipt proves that it is unchanged; only its owner may read the file. The
nonce prevents guessing the key from the hash among few possible keys. A real study's key comes from the operating
system's randomness, a rehearsal's from its seed, and a folder holds one or the other.

Fields that can reveal a condition are encrypted with the nonce (see `sealing`). In a journal these are the measures in
``trial_ended`` and ``interval_ended``, the presented level in the ``trial_started`` of a trial with a design, and the
numbers of samples and frames in ``recorded``; each line stores them as one text, ``sealed``. Recordings are encrypted
as whole files.

A file may leave the choice of effects and laws to the program (``effects = "auto"``) and its estimator to the format's
default; another version may choose otherwise. A receipt's protocol therefore names the estimator. The effects and laws
of each liquid, which reveal a condition, are stored in the receipt as one encrypted text, ``resolved``. Resume and
replay read these instead of resolving them again.
"""

import base64
import contextlib
import hashlib
import json
import secrets
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, Literal, TypeAlias

from study_app.errors import StoreError
from study_app.haptics.model.effects import EFFECTS
from study_app.haptics.model.gate import resolve
from study_app.number_text import counted
from study_app.protocol.model import Protocol, SceneDefaults, StudyLiquid
from study_app.protocol.orders import block_codes, draw_key
from study_app.protocol.randomization import draw_secret, enrolment_number, group_of, own_code, place_in_group
from study_app.protocol.source import RECORDED
from study_app.protocol.upgrade import needs_upgrade, upgraded_tables
from study_app.store import receipt
from study_app.store.blinded.sealing import TASK_BYTES, open_text, seal_values
from study_app.store.files.atomic import append_line, create_folder, is_there, parse_json, read_own
from study_app.store.files.columns import SEALED
from study_app.store.files.folders import SessionFolder, StudyFolder, check_name_and_reason
from study_app.store.journals import journal
from study_app.store.journals import journal_events as events

Codes: TypeAlias = dict[str, dict[str, str]]
_NO_FILES: Final[Mapping[str, str]] = MappingProxyType({})
_FORMATS: Final = (1, 2)
"""Formats of keys; keys of studies with designs have format 2, with stimuli, designs and methods."""
_DESIGN_KEYS: Final = ("conditions", "standard", "stimulus", "standards", "method")
"""Keys of a block with a design that only the sealed key contains."""
_RECEIPT_KEYS: Final = ("codes", "slots", "order", "compares")
"""Keys that a receipt adds to a block with a design."""
_SEALED_FIELDS: Final[Mapping[type[events.Event], frozenset[str]]] = {
    events.TrialStarted: frozenset({"level", "standard", "arrangement", "catch"}),
    events.IntervalEnded: SEALED | {"reached_s"},
    events.Allocated: frozenset({"group"}),
    events.Recorded: frozenset({"samples_recorded", "frames_recorded", "opened_sha256", "opened_frames_sha256"}),
    events.TrialEnded: SEALED | {"reached_s"},
}
"""The sealed fields of each event."""


@dataclass(frozen=True, slots=True)
class Key:
    """The opened key. Never print, log or show its content before it is revealed.

    ``codes`` is block → code → condition id, or track of a block with a design; ``tables`` holds the protocol's tables
    ``conditions`` and ``liquids``, for studies with designs also ``stimuli``, ``designs``, ``methods`` and the
    presented values of ``blocks``; ``files`` are the texts of its liquid files by name; ``groups`` is group → share, if
    participants are randomised to groups; ``drawn`` names the source of its randomness; ``hash`` is the SHA-256 of the
    sealed file; ``nonce`` is as secret as the codes.
    """

    hash: str
    drawn: Literal["system", "seed"]
    codes: Codes = field(repr=False)
    tables: dict[str, Any] = field(repr=False)
    tables_hash: str = field(repr=False)
    nonce: bytes = field(repr=False)
    files: dict[str, str] = field(repr=False, default_factory=dict)
    groups: dict[str, int] = field(repr=False, default_factory=dict)

    def condition(self, block: str, code: str) -> str:
        """Return the condition id of ``code`` in ``block``."""
        try:
            return self.codes[block][code]
        except KeyError:
            raise StoreError(
                f"the sealed key does not contain code {code!r} of block {block!r}: it belongs to another study"
            ) from None


def sealed_hash(folder: Path) -> str | None:
    """Return the SHA-256 of a study's sealed key, as in its receipts; None if the key is missing or unreadable."""
    try:
        return hashlib.sha256(journal.normalized_text(read_own(StudyFolder(folder).key, folder))).hexdigest()
    except StoreError:
        return None


def open_or_draw_key(
    folder: Path, protocol: Protocol, random: Callable[[], float] | None = None, files: Mapping[str, str] = _NO_FILES
) -> Key:
    """Return the study's key; draw and seal a new one if there is none.

    If two programs start at the same time, one draws the key and the other reads it.
    """
    study = StudyFolder(folder)
    drawn: Literal["system", "seed"] = "system" if random is None else "seed"
    if not is_there(study.key):
        _check_key_exists(study)
        content = _sealed_key(protocol, drawn, random or secrets.SystemRandom().random, files)
        create_folder(study.blinding, {study.key.name: content}, mode=0o600)
    key = verified_key(study)
    if key.drawn != drawn:
        kinds = {"system": "real sessions", "seed": "a rehearsal"}
        raise StoreError(
            f"{folder} contains {kinds[key.drawn]}, which must not be mixed with {kinds[drawn]}: use another results "
            "folder"
        )
    _check_same_conditions(study, key, protocol)
    return key


def check_conditions(folder: Path, protocol: Protocol) -> None:
    """Raise an error if the study's key was sealed for other conditions than those of ``protocol``; write nothing.

    Raises
    ------
    StoreError
        The key has other conditions, or cannot be used.
    """
    study = StudyFolder(folder)
    if is_there(study.key):
        _check_same_conditions(study, verified_key(study), protocol)


def _check_same_conditions(study: StudyFolder, key: Key, protocol: Protocol) -> None:
    if key.tables_hash != _tables_hash(protocol):
        raise StoreError(
            f"{study.key} was sealed for conditions that differ from this protocol (its liquids, conditions, stimuli, "
            "blocks or groups were changed): undo that change to continue the study, or choose a different study.name "
            "or results folder for the changed protocol"
        )


def has_same_conditions(folder: Path, protocol: Protocol) -> bool:
    """Return whether the key was sealed for the liquids, conditions, stimuli and blocks of ``protocol``."""
    return verified_key(StudyFolder(folder)).tables_hash == _tables_hash(protocol)


def reveal(folder: Path, by: str, reason: str) -> Codes:
    """Record who opens the key and why, and return the mapping block → code → condition id.

    A reveal equal to the last one, such as after an interrupted unblinding, is not recorded again.

    Raises
    ------
    StoreError
        ``by`` or ``reason`` is empty, or the key is missing, unreadable or not the one the sessions ran under.
    """
    by, reason = check_name_and_reason(by, reason, "opening the key requires a name and a reason, which are recorded")
    study = StudyFolder(folder)
    if not is_there(study.key) and not study.sessions():
        raise StoreError(
            f"{folder} is not a study folder ({study.key.name} is missing): specify one such as results/rek2024"
        )
    key = verified_key(study)
    record = {"by": by, "reason": reason, "key_hash": key.hash}
    earlier = reveals(folder)
    if not (earlier and record.items() <= earlier[-1].items()):
        at = datetime.now().astimezone().isoformat(timespec="seconds")
        line = json.dumps({"at": at, **record}, ensure_ascii=False).encode("utf-8", "backslashreplace")
        append_line(study.reveals, line + b"\n")
    return key.codes


def revealed_key(folder: Path) -> Key | None:
    """Return the key with the tables of conditions if it was revealed, else None.

    Raises
    ------
    StoreError
        The key was revealed, and is now missing, unreadable or changed.
    """
    study = StudyFolder(folder)
    return verified_key(study) if reveals(folder) else None


def reveals(folder: Path) -> tuple[dict[str, str], ...]:
    """Return the recorded reveals in order, each with ``at``, ``by``, ``reason`` and ``key_hash``."""
    return tuple(record for _, _, record in _reveal_lines(folder) if record is not None)


def unreadable_reveals(folder: Path) -> tuple[tuple[int, bool], ...]:
    """Return the line number of each invalid reveal, and whether a power cut may have truncated that line."""
    lines = [(number, line, record) for number, line, record in _reveal_lines(folder) if record is None]
    begins = b'{"at": "'
    return tuple((number, line[:8] == begins[: len(line)] and not line.endswith(b"}")) for number, line, _ in lines)


def _reveal_lines(folder: Path) -> Iterator[tuple[int, bytes, dict[str, str] | None]]:
    """Yield number, line and record of every line that is not empty."""
    path = StudyFolder(folder).reveals
    if not is_there(path):
        return
    for number, line in enumerate(read_own(path, folder).split(b"\n"), start=1):
        try:
            record = parse_json(line)
        except ValueError:
            record = None
        if line:
            yield number, line, record if _is_reveal(record) else None


def _is_reveal(record: object) -> bool:
    """Return whether ``record`` has the time, person, reason and key hash of a reveal."""
    return (
        _is_text_mapping(record)
        and isinstance(record, dict)
        and events.is_valid_value("at", record.get("at"))
        and all(record.get(name, "").strip() for name in ("by", "reason", "key_hash"))
    )


def _sealed_key(protocol: Protocol, drawn: str, random: Callable[[], float], files: Mapping[str, str]) -> bytes:
    content: dict[str, Any] = {
        "format": max(_FORMATS) if protocol.design_questions else min(_FORMATS),
        "drawn": drawn,
        "nonce": draw_secret(random).hex(),
        "codes": draw_key(protocol, random),
        "tables": _sealed_tables(protocol),
        "tables_hash": _tables_hash(protocol),
    }
    if files:
        content["files"] = dict(files)
    if protocol.randomises:
        content["groups"] = protocol.shares
    return base64.encodebytes(json.dumps(content, ensure_ascii=False).encode())


def _sealed_tables(protocol: Protocol) -> dict[str, Any]:
    """Return the tables that a receipt omits; ``blocks`` has the presented values of each block with a design."""
    tables = protocol.model_dump(mode="json", include={"conditions", "liquids", "stimuli", "designs", "methods"})
    if protocol.design_questions:
        designed = {name: protocol.blocks[name] for name in protocol.design_questions}
        tables["blocks"] = {
            name: {key: value for key, value in block.model_dump(mode="json").items() if key in _DESIGN_KEYS}
            for name, block in designed.items()
        }
    if protocol.analysis is not None:
        analysis = protocol.analysis.model_dump(mode="json", include={"published", "contrasts"})
        if revealing := {key: values for key, values in analysis.items() if values}:
            tables["analysis"] = revealing
    return tables


def _tables_hash(protocol: Protocol) -> str:
    """Return the hash of the conditions as written by their author, without defaults of later versions."""
    tables = {
        **protocol.model_dump(
            mode="json", include={"conditions", "liquids", "stimuli", "designs", "methods"}, exclude_unset=True
        ),
        "blocks": {name: [block_codes(protocol, block), block.conditions] for name, block in protocol.blocks.items()},
    }
    if protocol.design_questions:
        tables["designs"] = _sealed_tables(protocol)["blocks"]
    if protocol.randomises:
        tables["groups"] = protocol.shares
    return hashlib.sha256(json.dumps(tables, sort_keys=True).encode()).hexdigest()


def verified_key(study: StudyFolder) -> Key:
    """Read the key and compare its hash with the hash that every session published."""
    key = read_key(study.path)
    for session in study.sessions():
        if _published_hash(session) not in {None, key.hash}:
            raise StoreError(
                f"{study.key} is not the key for session {session.path} (its SHA-256 differs from the published one): "
                "restore it from a backup"
            )
    return key


def _published_hash(session: SessionFolder) -> str | None:
    """Return the key's hash that a session published.

    It is read from the receipt, or else from the journal's first line, so that a damaged session does not block others;
    None if neither is readable.
    """
    with contextlib.suppress(StoreError):
        return str(receipt.read(session.receipt)["key_hash"])
    with contextlib.suppress(StoreError):
        for line in journal.scan(session.journal).lines[:1]:
            return line.key_hash if isinstance(line, events.SessionStarted) else None
    return None


def read_key(folder: Path) -> Key:
    """Open the key without comparing its hash with that in the sessions. Never print its content.

    Raises
    ------
    StoreError
        The key is missing or invalid.
    """
    path = StudyFolder(folder).key
    sealed = journal.normalized_text(read_own(path, folder))
    try:
        content = parse_json(base64.b64decode(b"".join(sealed.split()), validate=True))
        if content["format"] not in _FORMATS:
            raise StoreError(
                f"{path} has format {content['format']!r}, but this version reads only formats 1 and 2: install a "
                "newer version"
            )
        _check_content(content)
        return Key(
            hash=hashlib.sha256(sealed).hexdigest(),
            drawn=content["drawn"],
            codes=content["codes"],
            tables=content["tables"],
            tables_hash=content["tables_hash"],
            nonce=bytes.fromhex(content["nonce"]),
            files=content.get("files", {}),
            groups=content.get("groups", {}),
        )
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise StoreError(f"{path} is no longer a sealed key: restore it from a backup") from error


def _check_content(content: dict[str, Any]) -> None:
    """Raise ValueError, KeyError, TypeError or AttributeError if the key's codes or conditions have a wrong type."""
    conditions = content["tables"]["conditions"].values()
    if (
        content["drawn"] not in ("system", "seed")
        or not all(map(_is_text_mapping, content["codes"].values()))
        or not isinstance(content["tables"]["liquids"], dict)
        or not _is_text_mapping(content.get("files", {}))
        or not all(type(proportion) is int and proportion > 0 for proportion in content.get("groups", {}).values())
        or not all(isinstance(condition["delay_ms"], int | float) for condition in conditions)
    ):
        raise ValueError("its codes or conditions are invalid")


def _is_text_mapping(value: object) -> bool:
    return isinstance(value, dict) and all(isinstance(text, str) for text in value.values())


def _check_key_exists(study: StudyFolder) -> None:
    used_by = [session for session in study.sessions() if is_there(session.receipt)]
    if used_by and not is_there(study.key):  # checked again: another program may have drawn the key in the meantime
        raise StoreError(
            f"{study.key} is missing, although {counted(len(used_by), 'session')} used it: restore it from a backup; "
            "without it, codes cannot be assigned to conditions"
        )


def complete_protocol(published: Mapping[str, Any], key: Key) -> Protocol:
    """Return the complete protocol: that of a receipt, with the parts sealed in the key.

    Raises
    ------
    KeyError, TypeError, AttributeError, ValueError
        Receipt and key do not form a protocol that this version supports.
    """
    blocks = {name: dict(block) for name, block in published["blocks"].items()}
    questionnaires = dict(published["questionnaires"])
    for name, block in blocks.items():
        if (design := key.tables.get("blocks", {}).get(name)) is not None:
            questionnaires.pop(block.pop("questionnaire"), None)
            for receipt_key in (*_RECEIPT_KEYS, *(("repetitions",) if design.get("stimulus") else ())):
                block.pop(receipt_key, None)
            block |= {field_name: value for field_name, value in design.items() if value}
        else:
            block["conditions"] = [key.condition(name, code) for code in block.pop("codes")]
    tables = {name: table for name, table in key.tables.items() if name != "blocks"}
    if "analysis" in tables:
        tables["analysis"] = {**published["analysis"], **tables["analysis"]}
    complete = {**published, **tables, "questionnaires": questionnaires, "blocks": blocks}
    if needs_upgrade(complete):
        complete = upgraded_tables(complete)
    if not complete.get("sequence"):  # each group has its own, or each session
        complete.pop("sequence", None)
    return Protocol.model_validate(complete, context=RECORDED)


def seal_event(start: events.SessionStarted, event: events.Event, key: Key) -> events.Event:
    """Return an event with its blinded fields sealed, as written in the journal of the session ``start``."""
    if start.own_codes and isinstance(event, events.TrialStarted):
        own = own_code(list(key.codes[event.block]), key.nonce, start.participant, event.block, event.code)
        text = seal_values([*_line_owner(start, event), "code"], {"code": event.code}, key.nonce)
        event = replace(event, code=own, sealed_code=text)
    line, names = event.line(), _SEALED_FIELDS.get(type(event), frozenset())
    measured = {name: value for name, value in line.items() if name in names}
    if not start.measures_sealed or not measured:
        return event
    rest = {name: value for name, value in line.items() if name not in names}
    if isinstance(event, events.EndOfTask):
        text = seal_values(_line_owner(start, event), measured, key.nonce, TASK_BYTES)
    else:
        text = seal_values(_line_owner(start, event), measured, key.nonce)
    return events.read_event({**rest, "sealed": text})


def open_events(lines: Iterable[events.Event], key: Key | None) -> list[events.Event]:
    """Return a journal's lines with their sealed fields opened; unchanged without a ``key``.

    Raises
    ------
    StoreError
        A sealed field was changed, belongs to another trial, or was sealed with another key.
    """
    lines = list(lines)
    if key is None or not lines:
        return lines
    start = events.start_of(lines)
    return [replace(start, group=participant_group(start, key)), *(_open_event(start, line, key) for line in lines[1:])]


def participant_group(start: events.SessionStarted, key: Key) -> str | None:
    """Return the group of a session's participant; None in a study without groups."""
    if start.entry is None or start.group is not None:
        return start.group
    return group_of(key.groups, key.nonce, start.entry)


def place_number(start: events.SessionStarted, key: Key) -> int | None:
    """Return the number that assigns a session its rows of squares, or None to use the number in the participant's id.

    It is the participant's place in the group. Without groups, and in studies with groups that began under a version
    that did not count places, it is the number in the id of the replaced participant.
    """
    if start.place_in_group and start.entry is not None:
        return place_in_group(key.groups, key.nonce, start.entry)[1] if key.groups else start.entry
    return None if start.row_of is None else enrolment_number(start.row_of)


def opened_key(folder: StudyFolder) -> Key | None:
    """Return the study's key if it was opened, or None while it is sealed.

    Raises
    ------
    StoreError
        The key was opened, and is now missing or unreadable.
    """
    return read_key(folder.path) if reveals(folder.path) else None


def _open_event(start: events.SessionStarted, line: events.Event, key: Key) -> events.Event:
    opened: dict[str, Any] = {}
    for name, suffix, names in (
        ("sealed", [], _SEALED_FIELDS.get(type(line), frozenset())),
        ("sealed_code", ["code"], frozenset({"code"})),
    ):
        if (text := getattr(line, name, None)) is None:
            continue
        if (measured := open_text([*_line_owner(start, line), *suffix], text, key.nonce, names)) is None:
            raise StoreError(
                f"line {line.n} of the journal cannot be decrypted with the study's key: it has been changed; restore "
                "the journal from a backup"
            )
        opened |= {**measured, name: None}
    return events.read_event({**line.line(), **opened}) if opened else line


def _line_owner(start: events.SessionStarted, line: Any) -> list[object]:
    """Return the owner of a line's sealed text: an attempt at a trial, or a participant's entry."""
    if isinstance(line, events.Allocated):
        return ["allocated", line.entry, start.participant]
    trial, attempt, interval = line.which
    owner = [start.participant, start.session, trial, attempt]
    return owner if isinstance(line, events.TrialEnded) else [*owner, line.event, interval]


def sealed_model(protocol: Protocol, participant: str, session: int, key: Key) -> str:
    """Return the effects and chosen laws of each liquid as a sealed text for one session."""
    return seal_values(_session_owner(participant, session), {"liquids": _resolved_effects(protocol)}, key.nonce)


def recorded_protocol(protocol: Protocol, receipt: Mapping[str, Any], key: Key) -> Protocol:
    """Return the protocol with the estimator, effects and laws that a session's receipt records.

    Receipts of earlier versions record the estimator alone.

    Raises
    ------
    StoreError
        A sealed field of the receipt was changed, or belongs to another session.
    """
    recorded: dict[str, Any] = {}
    if (text := receipt.get("resolved")) is not None:
        owner = _session_owner(receipt["participant"], receipt["session"])
        opened = open_text(owner, str(text), key.nonce, frozenset({"liquids"}))
        if not opened:
            raise StoreError(
                f"the field “resolved” in the receipt of {receipt['participant']} cannot be decrypted with the study's "
                "key: the receipt has been changed; restore it from a backup"
            )
        recorded = opened["liquids"]
    liquids = {
        name: StudyLiquid.model_validate(liquid.model_dump() | recorded[name]) if recorded.get(name) else liquid
        for name, liquid in protocol.liquids.items()
    }
    velocity = receipt["protocol"]["scene"]["velocity"]
    scene = SceneDefaults.model_validate(protocol.scene.model_dump() | {"velocity": velocity})
    return protocol.model_copy(update={"liquids": liquids, "scene": scene})


@contextlib.contextmanager
def protocol_errors(receipt: Path) -> Iterator[None]:
    """Convert errors raised while a protocol is made from receipt and key into `StoreError`."""
    try:
        yield
    except KeyError as error:
        raise StoreError(f"{receipt} does not contain {error}: restore it from a backup") from error
    except (AttributeError, TypeError, ValueError):  # the reason is omitted, since it could reveal conditions
        raise StoreError(
            f"{receipt} and the study's key cannot be combined into a protocol that this version can run: restore both "
            "from a backup"
        ) from None


def _resolved_effects(protocol: Protocol) -> dict[str, Any]:
    chosen = [effect.name for effect in EFFECTS if effect.choose is not None]
    by_liquid = {}
    for name in sorted(protocol.liquids):
        (liquid,) = resolve(protocol.scene_of(name)).liquids
        laws = {table: getattr(liquid, table).model_dump(mode="json") for table in chosen}
        by_liquid[name] = {"effects": list(liquid.effects), **laws}
    return by_liquid


def _session_owner(participant: str, session: int) -> list[object]:
    return ["resolved", participant, session]
