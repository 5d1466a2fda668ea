"""The receipt, metadata of a session for readers of the results: everything except the conditions.

The receipt holds the protocol without its liquids, its conditions and the blocks' lists of conditions (which are sealed
in the key), the SHA-256 of the whole protocol file and of the sealed key, the seed and its generator, versions, device,
screens and the clock's origin. It is written before the first trial, at each resumption, and with the final status at
the end.
"""

import hashlib
import json
import platform
from collections.abc import Iterable, Mapping
from contextlib import suppress
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any, Final

import study_app
from study_app.discovery import registry
from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.protocol.orders import block_codes, order_of
from study_app.store.files.atomic import parse_json, read_own, study_root, write_file
from study_app.store.journals.journal_events import SessionStarted, is_valid_value, plain_json, shorten_value

GENERATOR = (
    "random.Random (Mersenne Twister), one per named stream, seeded by SHA-256 of (seed, name); only .random() is "
    "used, under Fisher-Yates in Durstenfeld's form"
)
UNFINISHED = "unfinished"
_LATER_FIELDS = ("status", "reason", "ended_at", "resumed", "outlets_lost")

_LIBRARIES = ("numpy", "numba", "pydantic", "PySide6-Essentials", "pyqtgraph", "pyarrow")

# Fields of every receipt; the first lines are also fields of the journal.
COPIED_FIELDS = (
    "participant", "session", "study", "seed", "language", "operator", "simulated", "pilot", "recordings",
    "key_hash", "protocol_hash", "version",
)  # fmt: skip
FIELDS = (
    "format", "status", "reason", "started_at", "ended_at", "resumed", *COPIED_FIELDS, "generator", "versions",
    "device", "screens", "clock", "protocol",
)  # fmt: skip


ANSWER: Final = "/answer"
"""The end of the name of a block's design question, which no questionnaire of a study can have."""


def without_conditions(protocol: Protocol) -> dict[str, Any]:
    """Return the protocol as a JSON value without blinded parts; blocks contain their codes and compared attributes."""
    shown = protocol.model_dump(
        mode="json",
        exclude={
            **dict.fromkeys(("liquids", "conditions", "stimuli", "methods"), True),
            "designs": {"__all__": {"modulus"}},
            "analysis": {"published", "contrasts"},
        },
    )
    for name, block in protocol.blocks.items():
        table = shown["blocks"][name]
        for hidden in ("conditions", "standard", "stimulus", "standards", "method"):
            table.pop(hidden, None)
        table["codes"] = list(block_codes(protocol, block))
        table["compares"] = protocol.compared_in(name)
        if block.design is not None:
            orders = order_of(protocol, block)
            questionnaire = f"{name}{ANSWER}"
            table |= {"order": orders.order, "slots": list(orders.slots), "questionnaire": questionnaire}
            shown["questionnaires"][questionnaire] = protocol.design_questions[name].model_dump(mode="json")
    return shown


def versions() -> dict[str, str]:
    """Return the versions of the program, Python, the operating system and the libraries."""
    return {
        "liquid-study": study_app.__version__,
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        **{library: library_version(library) for library in _LIBRARIES},
    }


def plug_ins_of(protocol: Protocol, device: str, outlets: Iterable[str]) -> list[dict[str, str]]:
    """Return the plug-ins that a session uses for its protocol, device and outlets (by title)."""
    outlets_registry = registry("outlet")
    used_kinds = [
        *(("task", task.kind) for task in protocol.tasks.values()),
        *(("method", method.kind) for method in protocol.methods.values()),
        *(("question", item.kind_id) for form in protocol.questionnaires.values() for item in form.items),
        ("device", device.partition(":")[0]),
    ]
    if others := set(outlets) - {kind.title for kind in outlets_registry.own.values()}:
        used_kinds += [("outlet", kind.name) for kind in outlets_registry.others.values() if kind.title in others]
    plug_ins = {plug_in for kind, name in used_kinds if (plug_in := registry(kind).plug_in(name)) is not None}
    return [plug_in.described for plug_in in sorted(plug_ins, key=lambda plug_in: (plug_in.kind, plug_in.name))]


def recorded_plug_ins(receipts: Iterable[Path]) -> dict[str, list[str]]:
    """Return kinds and names of the plug-ins in receipts, by package and version."""
    by_package: dict[str, set[str]] = {}
    for path in receipts:
        with suppress(StoreError, KeyError, TypeError):
            for plug_in in read(path).get("plug_ins", ()):
                by_package.setdefault(f"{plug_in['package']} {plug_in['version']}", set()).add(
                    f"{plug_in['kind']} {plug_in['name']}"
                )
    return {package: sorted(names) for package, names in sorted(by_package.items())}


@cache
def library_version(library: str) -> str:
    """Return the version of a library; its metadata are read from the disk once."""
    try:
        return metadata.version(library)
    except metadata.PackageNotFoundError:
        return "not installed"


def write(path: Path, receipt: Mapping[str, Any]) -> None:
    """Write the receipt in one step."""
    text = json.dumps(plain_json(dict(receipt)), indent=2, ensure_ascii=False, allow_nan=False)
    write_file(path, f"{text}\n".encode("utf-8", "backslashreplace"))


def digest(record: Mapping[str, Any]) -> str:
    """Return the SHA-256 of a receipt, or of one entry of its ``resumed``, without the fields that change later."""
    unchanging = {name: value for name, value in record.items() if name not in _LATER_FIELDS}
    return hashlib.sha256(json.dumps(plain_json(unchanging), sort_keys=True).encode()).hexdigest()


def read(path: Path) -> dict[str, Any]:
    """Read and check a receipt.

    Raises
    ------
    StoreError
        The file is missing or not a receipt.
    """
    try:
        receipt = parse_json(read_own(path, study_root(path)))
    except ValueError as error:
        raise StoreError(f"{path} is not a receipt ({error}): restore it from a backup") from error
    if not isinstance(receipt, dict) or "key_hash" not in receipt:
        raise StoreError(f"{path} is not a receipt (no key_hash): restore it from a backup")
    for name, value in receipt.items():
        if not _is_valid_field(name, value):
            raise StoreError(f"{path} is not a receipt ({name} is {shorten_value(value)}): restore it from a backup")
    return receipt


def began_at(receipt: Mapping[str, Any]) -> str | None:
    """Return the time when a person began a session, as ISO 8601; None if the receipt does not contain it.

    A pilot that is played from a later step begins with steps answered by a simulated participant. It is resumed
    immediately, and the time of that resumption is returned.
    """
    first_resume = next(iter(receipt.get("resumed") or ()), None)
    skips_steps = isinstance(first_resume, dict) and bool((receipt.get("screens") or {}).get("steps"))
    return first_resume.get("at") if isinstance(first_resume, dict) and skips_steps else receipt.get("started_at")


def has_other_format(receipt: Mapping[str, Any], start: SessionStarted) -> bool:
    """Return whether the format of a journal that begins with ``start`` differs from that of its receipt."""
    return bool(receipt.get("format", 1) != (start.format or 1))


def _is_valid_field(name: str, value: object) -> bool:
    """Return whether ``value`` has the type of the receipt's field ``name``."""
    if name in (
        "versions",
        "device",
        "screens",
        "clock",
        "protocol",
        "motors_masked",
        "outlets",
        "outlets_lost",
        "video",
    ):
        return isinstance(value, dict)
    if name in ("plug_ins", "resumed"):
        return isinstance(value, list)
    if name in ("started_at", "ended_at"):
        return value is None or is_valid_value("at", value)
    return is_valid_value(name, value)
