"""The differences between two protocols, for a session that is continued with a changed file.

Values that blinding hides are compared but never shown: for the conditions, the liquids and the blocks' lists of
conditions, the result is only that they differ.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import block_codes
from study_app.protocol.source.problems import shown_value

CONDITIONS_DIFFER = "conditions differ"

_HIDDEN = ("conditions", "liquids")


_Place: TypeAlias = tuple[str | int, ...]
"""A path in two protocols: keys, IDs of entries, and indices from 0."""


class Difference(NamedTuple):
    """A path at which two protocols differ, and the change as text."""

    place: _Place
    change: str

    @property
    def sentence(self) -> str:
        """The path, with entries counted from 1, and the change."""
        return f"{'.'.join(str(step + 1) if isinstance(step, int) else step for step in self.place)}: {self.change}"


def differences(old: Protocol | Mapping[str, Any], new: Protocol | Mapping[str, Any]) -> tuple[str, ...]:
    """Return a sentence for each difference between two protocols; empty if they are equal.

    A mapping is a protocol from a receipt: JSON values, without conditions, blocks with their codes. Conditions are
    compared only if both sides have them: add ``conditions`` and ``liquids`` from the opened key, or compare hashes.
    """
    before, after = _tables(old), _tables(new)
    _drop_unknown_comparisons(before, after)
    hidden = [_pop_hidden(tables) for tables in (before, after)]
    sentences = [difference.sentence for difference in document_differences(before, after)]
    if any(hidden[0][place] != hidden[1][place] for place in hidden[0].keys() & hidden[1].keys()):
        sentences.append(CONDITIONS_DIFFER)
    return tuple(sentences)


def document_differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> tuple[Difference, ...]:
    """Return the differences between two documents, conditions included; arrays are lists."""
    return tuple(_differences((), old, new))


def _tables(protocol: Protocol | Mapping[str, Any]) -> dict[str, Any]:
    """Return the tables as JSON values in new dictionaries, blocks with their codes."""
    if isinstance(protocol, Protocol):
        tables = protocol.model_dump(mode="json")
        for name, block in protocol.blocks.items():
            tables["blocks"][name]["codes"] = list(block_codes(protocol, block))
            tables["blocks"][name]["compares"] = protocol.compared_in(name)
        return tables
    blocks = {name: dict(block) for name, block in protocol.get("blocks", {}).items()}
    return {**protocol, "blocks": blocks}


def _drop_unknown_comparisons(before: dict[str, Any], after: dict[str, Any]) -> None:
    """Drop a block's comparison if one side, a receipt of an earlier version, does not state it."""
    for name in before["blocks"].keys() & after["blocks"].keys():
        sides = before["blocks"][name], after["blocks"][name]
        if not all("compares" in block for block in sides):
            for block in sides:
                block.pop("compares", None)


def _pop_hidden(tables: dict[str, Any]) -> dict[str, Any]:
    """Remove the values that blinding hides, and return them by path."""
    hidden = {name: tables.pop(name) for name in _HIDDEN if name in tables}
    for name, block in tables["blocks"].items():
        if "conditions" in block:
            hidden[f"blocks.{name}"] = block.pop("conditions")
    return hidden


def _differences(place: _Place, old: Any, new: Any) -> Iterator[Difference]:
    """Yield the differences at a path; a key that is None counts as missing."""
    if _has_ids(old) and _has_ids(new):
        yield from _entry_differences(place, old, new)
    elif isinstance(old, Mapping) and isinstance(new, Mapping):
        for key in dict.fromkeys((*old, *new)):
            yield from _differences((*place, key), old.get(key), new.get(key))
    elif isinstance(old, list) and isinstance(new, list):
        if len(old) != len(new):
            yield Difference(place, f"previously {len(old)} entries, now {len(new)}")
        else:
            for index, (before, after) in enumerate(zip(old, new, strict=True)):
                yield from _differences((*place, index), before, after)
    elif old is None and new is not None:
        yield Difference(place, f"new: {shown_value(new)}")
    elif new is None and old is not None:
        yield Difference(place, f"removed; previously {shown_value(old)}")
    elif old != new:
        before, after = shown_value(old), shown_value(new)
        yield Difference(
            place, f"previously {before}, now {after}" if before != after else "a different text or number"
        )


def _has_ids(value: Any) -> bool:
    """Return whether a value is a list of tables with unique ids."""
    if not isinstance(value, list):
        return False
    ids = [entry.get("id") if isinstance(entry, Mapping) else None for entry in value]
    return all(isinstance(identifier, str) for identifier in ids) and len(set(ids)) == len(ids)


def _entry_differences(
    place: _Place, old: Sequence[Mapping[str, Any]], new: Sequence[Mapping[str, Any]]
) -> Iterator[Difference]:
    """Yield the differences between tables matched by id, then differences in the order of common tables."""
    before, after = ({entry["id"]: entry for entry in entries} for entries in (old, new))
    yield from _differences(place, before, after)
    common_ids = before.keys() & after.keys()
    if [name for name in before if name in common_ids] != [name for name in after if name in common_ids]:
        yield Difference(place, "in a different order")
