"""Edits that move entries of one list together: steps of the session, questions, names in a list."""

from collections.abc import Sequence
from typing import Any

from study_app.designer.document.edited_study import Study
from study_app.designer.document.writer.edits import Edit, Move, Set
from study_app.designer.document.writer.refused import Refused
from study_app.protocol.source.document import Path, has


def moved(study: Study, entries: Sequence[Path], to: int) -> tuple[tuple[Edit, ...], tuple[Path, ...]]:
    """Return the edits that move entries of a list, in their order, before the entry ``to``, and their new paths.

    Parts of the study are renumbered if they were numbered correctly before.

    Parameters
    ----------
    study : Study
        The study.
    entries : sequence of path
        Entries of one list.
    to : int
        The index, before the move, of the entry that they come before; the length of the list for its end.

    Raises
    ------
    Refused
        They are not in one list.
    """
    places = sorted({entry[:-1] for entry in entries}, key=str)
    if len(places) != 1:
        raise Refused("these elements are in several lists: only neighbours of one list move together")
    place = places[0]
    indices = sorted({int(entry[-1]) for entry in entries})
    before = [index for index in indices if index < to]
    after = [index for index in indices if index >= to]
    moves: list[Edit] = []
    for done, index in enumerate(before):
        if index - done != to - 1:
            moves.append(Move((*place, index - done), to - 1))
    moves += [Move((*place, index), to + done) for done, index in enumerate(after) if index != to + done]
    first = to - len(before)
    paths = tuple((*place, first + number) for number in range(len(indices)))
    return (*moves, *_renumbered(study, place, moves)), paths


def _renumbered(study: Study, place: Path, moves: Sequence[Edit]) -> tuple[Edit, ...]:
    """Return the edits that number the parts of the session 1, 2 … again."""
    if place != ("sequence",) or not moves or any(fault.path[2:] == ("part",) for fault in study.faults):
        return ()
    after, _ = study.edited(*moves)
    blocks: Any = after.document.get("blocks", {})
    edits: list[Edit] = []
    old = number = 0
    for name in after.document["sequence"]:
        part = blocks[name].get("part") if has(blocks, name) else None
        if not isinstance(part, int):
            continue
        number += part != old
        old = part
        if part != number:
            edits.append(Set(("blocks", name, "part"), number))
    return tuple(edits)
