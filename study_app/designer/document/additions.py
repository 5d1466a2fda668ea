"""New elements with the keys that check requires and valid initial values; only their texts remain to be written."""

import re
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, Final

from study_app.designer.document.edited_study import Study
from study_app.designer.document.fields import label_of, row_at, rows
from study_app.designer.document.initial_values import LETTER, initial, singular
from study_app.designer.document.names import check_id, sections_at
from study_app.designer.document.writer.edits import Duplicate, Edit, Insert, Set
from study_app.designer.document.writer.refused import Refused
from study_app.designer.problems.repairs import Repair, is_unknown_name, removes, repairs
from study_app.ids import free_id
from study_app.protocol.source.document import Path, entries, names, value_at
from study_app.protocol.source.problems import Fault, rule_of

_ROUNDS: Final = 12
_KNOWN: Final = re.compile(r"known: (.+)")


def added(
    study: Study,
    section: Path,
    kind: Mapping[str, Any] | None = None,
    *,
    name: str = "",
    behind: str | int | None = None,
) -> tuple[tuple[Edit, ...], Path]:
    """Return the edits that add an element to a section or list, as one step, and the path of the element.

    Parameters
    ----------
    study : Study
        The study; its existing faults stay.
    section : tuple of str or int
        A section of tables, as ``("liquids",)``, or a list of tables, as ``("questionnaires", "load", "items")``.
    kind : mapping, optional
        Initial keys of the element, such as its kind.
    name : str
        Preferred name of a table; "": by its section.
    behind : str or int, optional
        The table or entry of the section that it is written after; the last one without.

    Raises
    ------
    Refused
        Nothing can be added there.
    """
    row = row_at(study.document, section)
    if row is None or row.kind not in {"tables", "list"}:
        raise Refused(f"nothing can be added to {label_of(section[-1])}")
    several = row.kind == "list"
    value: dict[str, Any] = dict(kind or {})
    path: Path
    first: Edit
    if several:
        count = len(row.value or ())
        path = (*section, behind + 1 if isinstance(behind, int) and behind < count else count)
        entry = row_at(study.document, path)
        made = initial(study.document, path) if entry is not None and entry.kind == "references" else value
        first = Insert(path, made) if row.value else Set(section, [made])
    else:
        path = (*section, free_id(names(study.document, str(section[0])), name or singular(section[-1])))
        first = Set(path, value, behind if isinstance(behind, str) else None)
    others: list[Edit] = []
    tried = {(fault.path, fault.message) for fault in study.faults}
    for _ in range(_ROUNDS):
        after, _splices = study.edited(first, *others)
        fault = next((one for one in after.faults if (one.path, one.message) not in tried), None)
        if fault is None:
            break
        tried.add((fault.path, fault.message))
        inner = fault.path[len(path) :] if fault.path[: len(path)] == path else ()
        if inner and value_at(after.document, fault.path) is None:
            asked = row_at(after.document, fault.path)
            if asked is not None and asked.kind == "reference" and asked.sections and not asked.choices:
                named, made = added(after, asked.sections[:1])
                others += named
                _put(value, inner, made[-1])
            else:
                _put(value, inner, initial(after.document, fault.path))
        elif inner and (known := _KNOWN.match(fault.hint)):
            for word in known[1].split(", "):
                _put(value, inner, word)
                if fault.path not in {one.path for one in study.edited(first, *others)[0].faults}:
                    break
        else:
            others += _outside(after, fault)
    return (first, *others), path


def additions_for(study: Study, fault: Fault) -> tuple[Repair, ...]:
    """Return the repairs of a reference to a missing element: each adds an element of that name."""
    name = value_at(study.document, fault.path)
    if not is_unknown_name(fault) or not isinstance(name, str):
        return ()
    found: list[Repair] = []
    for section in sections_at(fault.path):
        with suppress(Refused):
            check_id(name)
            found.append(Repair(f'Add {singular(section)} "{name}"', added(study, (section,), name=name)[0]))
    return tuple(one for one in found if removes(study, fault, one))


def duplicated(study: Study, path: Path, wanted: str = "") -> tuple[tuple[Edit, ...], Path]:
    """Return the edits that copy an element right after itself, as one step, and the path of the copy.

    The copy has the name ``wanted``, or the next free one, the next free code letter, and a place in the session if it
    needs one. Its texts are those of the original.

    Raises
    ------
    Refused
        There is no such element.
    """
    table = value_at(study.document, path)
    if not isinstance(table, Mapping):
        raise Refused(f"{label_of(path[-1])} cannot be copied")
    last = path[-1]
    name = table.get("id", last) if isinstance(last, int) else last
    if isinstance(last, int):
        pattern = ".".join((*map(str, path[:2]), "*", "*"))
        taken = [entry.get("id") for _, entry in entries(study.document, pattern) if isinstance(entry, Mapping)]
        copy: Path = (*path[:-1], last + 1)
        edits: list[Edit] = [Duplicate(path)]
        if isinstance(name, str):
            edits.append(Set((*copy, "id"), free_id(filter(None, taken), name)))
    else:
        copy = (*path[:-1], wanted or free_id(names(study.document, str(path[0])), str(name)))
        edits = [Duplicate(path, str(copy[-1]))]
    return (*edits, *fitted(study, study.edited(*edits)[0], copy)), copy


def fitted(before: Study, after: Study, path: Path) -> tuple[Edit, ...]:
    """Return the additional edits for a copied element: a free code letter, and a place in the session.

    Parameters
    ----------
    before, after : Study
        The study without and with the copy.
    path : tuple of str or int
        The copy.
    """
    edits: list[Edit] = []
    for row in rows(after.document, path):
        if row.value is not None and rule_of(LETTER) in row.bounds:
            letters = [letter for _, letter in entries(after.document, f"{path[0]}.*.{row.path[-1]}")]
            edits += [Set(row.path, initial(after.document, row.path))] if letters.count(row.value) > 1 else []
    after, _ = after.edited(*edits)
    for fault in after.faults:
        if fault.path == path and fault not in before.faults:
            edits += _outside(after, fault)
    return tuple(edits)


def _outside(study: Study, fault: Fault) -> tuple[Edit, ...]:
    """Return the edits elsewhere that a new element needs, such as its place in the session."""
    offered = repairs(study, fault)
    return offered[0].edits if offered else ()


def _put(value: dict[str, Any], path: Path, inner: Any) -> None:
    for step in path[:-1]:
        value = value.setdefault(str(step), {})
    value[str(path[-1])] = inner
