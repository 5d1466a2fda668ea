"""Measures of a trial that can reveal its condition: encrypted in the journal until the study's key is opened.

A line ``trial_ended`` or ``interval_ended`` holds these columns, a line ``trial_started`` of a trial with a design what
it presents, as one text, ``sealed``: in hexadecimal digits a tag, and their JSON
encrypted with the nonce of the sealed key. The tag is the HMAC-SHA256 of session, trial and JSON; the JSON is combined
with SHAKE-256 of nonce and tag by exclusive or. So equal numbers of two trials look different, and a changed or moved
text is detected (a synthetic initialisation vector as in RFC 5297, with the standard library's hashes). Spaces make all
texts equally long.
"""

import hashlib
import hmac
import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from study_app.errors import StoreError
from study_app.protocol.streams import group_of
from study_app.store.blinded.blinding import Key, read_key, reveals
from study_app.store.folders import StudyFolder
from study_app.store.journals.journal import Line, plain
from study_app.store.journals.journal_events import holds
from study_app.store.journals.parsing import parse_json
from study_app.store.tables.columns import SEALED

_SEALED_IN: Final[Mapping[str, frozenset[str]]] = {
    "trial_started": frozenset({"level", "standard", "arrangement", "catch"}),
    "interval_ended": SEALED,
    "allocated": frozenset({"group"}),
    "trial_ended": SEALED,
}
"""The fields that each event's lines hold sealed."""
_TAG_BYTES = 16
_BLOCK_BYTES = 1024


def sealed(start: Mapping[str, Any], event: str, fields: dict[str, Any], key: Key) -> dict[str, Any]:
    """Return the fields of a line as the journal of a session that began with the line ``start`` holds them."""
    names = _SEALED_IN.get(event, frozenset())
    measured = {name: value for name, value in fields.items() if name in names}
    if not start.get("measures_sealed") or not measured:
        return fields
    text = seal(_whose(start, {**fields, "event": event}), measured, key)
    return {**{name: value for name, value in fields.items() if name not in names}, "sealed": text}


def seal(whose: Sequence[object], values: Mapping[str, Any], key: Key) -> str:
    """Return values as a sealed text; ``whose`` identifies their owner, and is needed to open it."""
    said = json.dumps(plain(values), allow_nan=False, separators=(",", ":")).encode()
    said = said.ljust(-(-len(said) // _BLOCK_BYTES) * _BLOCK_BYTES)
    tag = _tag(whose, said, key)
    return (tag + _combined(said, tag, key)).hex()


def open_text(whose: Sequence[object], text: str, key: Key, names: frozenset[str]) -> dict[str, Any] | None:
    """Return the values of these names from `seal`; None if the text was changed, or has another owner or key."""
    try:
        content = bytes.fromhex(text)
    except ValueError:
        content = b""
    tag = content[:_TAG_BYTES]
    said = _combined(content[_TAG_BYTES:], tag, key)
    return _measured(said, names) if hmac.compare_digest(tag, _tag(whose, said, key)) else None


def opened(lines: Iterable[Line], key: Key | None) -> list[Line]:
    """Return a journal's lines with their sealed values; unchanged without a ``key``.

    Raises
    ------
    StoreError
        What is sealed was changed, is of another trial, or was sealed with another key.
    """
    lines = list(lines)
    if key is None or not lines:
        return lines
    start, *rest = lines
    if "entry" in start:
        start = start | {"group": group_of(key.groups, key.nonce, start["entry"])}
    return [start, *(_opened(start, line, key) if "sealed" in line else line for line in rest)]


def opened_key(folder: StudyFolder) -> Key | None:
    """Return the study's key if it was opened, None while it is sealed.

    Raises
    ------
    StoreError
        It was opened, and is now missing or unreadable.
    """
    return read_key(folder.path) if reveals(folder.path) else None


def _opened(start: Line, line: Line, key: Key) -> Line:
    measured = open_text(_whose(start, line), line["sealed"], key, _SEALED_IN.get(line["event"], frozenset()))
    if measured is None:
        raise StoreError(
            f"line {line['n']} of the journal cannot be decrypted with the study's key: it was changed; restore it "
            "from a copy"
        )
    return {**{name: value for name, value in line.items() if name != "sealed"}, **measured}


def _measured(said: bytes, names: frozenset[str]) -> dict[str, Any]:
    """Return the columns in a text with a valid tag, without any that a holder of the key has forged."""
    try:
        measured = parse_json(said)
    except ValueError:
        return {}
    items = measured.items() if isinstance(measured, dict) else ()
    return {name: value for name, value in items if name in names and holds(name, value)}


def _whose(start: Mapping[str, Any], line: Mapping[str, Any]) -> list[object]:
    """Return the owner of a line's sealed text: an attempt at a trial, or a participant's entry."""
    if "entry" in line:
        return ["allocated", line["entry"], start["participant"]]
    whose = [start["participant"], start["session"], line["trial"], line["attempt"]]
    return whose if line["event"] == "trial_ended" else [*whose, line["event"], line.get("interval")]


def _tag(whose: Sequence[object], said: bytes, key: Key) -> bytes:
    return hmac.digest(key.nonce, json.dumps(whose).encode() + said, "sha256")[:_TAG_BYTES]


def _combined(text: bytes, tag: bytes, key: Key) -> bytes:
    stream = hashlib.shake_256(key.nonce + tag).digest(len(text))
    return (int.from_bytes(text) ^ int.from_bytes(stream)).to_bytes(len(text))
