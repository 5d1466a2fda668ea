import os
import time
import tomllib
from collections import Counter
from random import Random
from typing import Any

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from study_app.authoring.writer.edits import Duplicate, Edit, Insert, Move, Rename, Set, Unset, apply, meaning, same
from study_app.authoring.writer.refused import Refused
from study_app.authoring.writer.splices import Splices, applied, reverted
from study_app.protocol.source.document import Path
from study_app.protocol.source.notation import scan
from tests.authoring.comments import FREE, owners
from tests.authoring.grown import texts

EDITS = int(os.environ.get("LIQUID_STUDY_EDITS", "0"))
"""How many random edits are made; without it about 200. `tests/benchmarks/windows/designer.py` prints their times."""
TEXTS = texts()

TEXT = ["water", "Two words", "it's", 'say "x"', "one\n\ntwo\n", "tab\t", "\\", "é", "x" * 130, "", "#", "[a]"]
NAMES = ["new", "other_2", "with blank", "dot.ted"]


def value_of(random: Random, depth: int = 0) -> Any:
    """Return a random value."""
    kind = random.randrange(6 if depth < 2 else 4)
    if kind < 4:
        return (random.choice(TEXT), random.randrange(-5, 2000), random.gauss(0, 1), random.random() < 0.5)[kind]
    if kind == 4:
        return [value_of(random, depth + 1) for _ in range(random.randrange(4))]
    return {name: value_of(random, depth + 1) for name in random.sample(["en", "nl", "a b", "x"], random.randrange(4))}


def paths(node: Any, path: Path = ()) -> list[Path]:
    """Return the paths of everything in a document."""
    inner = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    return [found for key, value in inner for found in ((*path, key), *paths(value, (*path, key)))]


def at(document: Any, path: Path) -> Any:
    for step in path:
        document = document[step]
    return document


def edit_of(random: Random, text: str) -> Edit:
    """Return a random edit of a text, every second one of what has comments; it may be one that makes no sense."""
    document = tomllib.loads(text)
    known = paths(document)
    commented = [path for path, _ in owners(text) if path in known and random.random() < 0.5]
    known = commented or known
    name, new = random.choice(NAMES), value_of(random)
    if not known:
        return Set((name,), new)
    path = random.choice(known)
    value, parent = at(document, path), at(document, path[:-1])
    several = isinstance(parent, list)
    choices: list[Edit] = [Set(path, new), Unset(path), Duplicate(path, name)]
    if several:
        choices += [Insert(path, new), Move(path, random.randrange(len(parent)))]
    else:
        naming = tuple(one for one in known if at(document, one) == path[-1] and one[: len(path)] != path)
        choices += [Rename(path, name, naming), Set((*path[:-1], name), new, random.choice([None, path[-1]]))]
    if isinstance(value, dict):
        choices += [Set((*path, name), new, random.choice([None, *value])), Set((*path, name, "inner"), new)]
    if isinstance(value, list):
        choices.append(Insert((*path, len(value)), new))
    return random.choice(choices)


def renumbered(path: Path, edit: Edit) -> Path | None:
    """Return where a path of the text before an edit is after it; None where the edit may touch its comments."""
    at_, depth = edit.path, len(edit.path) - 1
    if path[:depth] != at_[:depth] or len(path) <= depth:
        return path
    step, last = path[depth], at_[depth]
    if isinstance(edit, Rename):
        return (*at_[:depth], edit.name, *path[depth + 1 :]) if step == last else path
    if isinstance(edit, Set):
        return None if step == last else path
    if isinstance(step, str) or isinstance(last, str):
        return None if step == last and isinstance(edit, Unset) else path
    if isinstance(edit, Unset):
        return None if step == last else (*at_[:depth], step - (step > last), *path[depth + 1 :])
    if isinstance(edit, Insert):
        return (*at_[:depth], step + (step >= last), *path[depth + 1 :])
    if isinstance(edit, Duplicate):
        return (*at_[:depth], step + (step > last), *path[depth + 1 :])
    order = list(range(max(step, last, edit.to) + 1))
    order.insert(edit.to, order.pop(last))
    return (*at_[:depth], order.index(step), *path[depth + 1 :])


def check_comments(before: str, after: str, edit: Edit) -> None:
    old, new = owners(before), owners(after)
    for (path, comment), count in old.items():
        if path == FREE:
            continue
        moved = renumbered(path, edit)
        if moved is not None:
            assert new[moved, comment] >= count, (path, moved, comment)
        elif isinstance(edit, Unset):
            everywhere = [sum(n for (_, words), n in one.items() if words == comment) for one in (old, new)]
            assert everywhere[1] <= everywhere[0] - count, (path, comment)
        if isinstance(edit, Duplicate) and path[: len(edit.path)] == edit.path:
            last = edit.path[-1]
            copy = (*edit.path[:-1], last + 1 if isinstance(last, int) else edit.name, *path[len(edit.path) :])
            assert new[copy, comment] >= count, (path, comment)
    kept = Counter(comment for (path, comment) in old.elements() if path == FREE)
    there = Counter(comment for (_, comment) in new.elements())
    if not isinstance(edit, Unset | Set):
        assert not kept - there


def values_of(text: str) -> dict[Path, str]:
    """Return how each value that holds no other one is written."""
    nodes = [node for node in scan(text) if node.kind in {"key", "pair", "entry"}]
    inner = {node.path[:length] for node in nodes for length in range(len(node.path))}
    return {node.path: text[node.value : node.end] for node in nodes if node.path not in inner}


def unmeant_changes(before: str, after: str, edit: Edit) -> list[Path]:
    """Return the values that an edit does not concern and that are written in another way after it."""
    old, new = values_of(before), values_of(after)
    concerned = {edit.path[:length] for length in range(len(edit.path))}
    concerned |= set(edit.references) if isinstance(edit, Rename) else set()
    places = {path: renumbered(path, edit) for path in old if path not in concerned}
    return [path for path, place in places.items() if place is not None and new.get(place) != old[path]]


def check_edit(text: str, edit: Edit) -> tuple[str, list[Splices]]:
    meant = meaning(tomllib.loads(text), edit)
    begin = time.thread_time()
    after, steps = apply(text, edit)
    TIMES.append(1000 * (time.thread_time() - begin))
    found = tomllib.loads(after)
    changed = text
    for step in steps:
        changed = applied(changed, step)
    assert changed == after
    for step in reversed(steps):
        changed = applied(changed, reverted(step))
    assert changed == text
    holds_nothing = isinstance(edit, Unset) or (isinstance(edit, Set) and "{}" in str(edit.value))
    assert same(found, meant) or holds_nothing
    check_comments(text, after, edit)
    assert not unmeant_changes(text, after, edit)
    return after, list(steps)


TIMES: list[float] = []
MADE: list[int] = []


def walk(random: Random, text: str, count: int) -> int:
    """Make, undo and redo random edits of a text; return how many were made."""
    first, made = text, 0
    done: list[tuple[str, list[Splices]]] = []
    undone: list[tuple[str, list[Splices]]] = []
    for _ in range(count):
        action = random.randrange(8)
        if action == 0 and done:
            undone.append((text, done[-1][1]))
            text = done.pop()[0]
        elif action == 1 and undone:
            after, steps = undone.pop()
            done.append((text, steps))
            for step in steps:
                text = applied(text, step)
            assert text == after
        else:
            edit = edit_of(random, text)
            try:
                after, steps = check_edit(text, edit)
            except Refused:
                continue
            done.append((text, steps))
            undone.clear()
            text, made = after, made + 1
    for _, steps in reversed(done):
        for step in reversed(steps):
            text = applied(text, reverted(step))
    assert text == first
    return made


@pytest.mark.slow
@pytest.mark.timeout(1800)
@settings(max_examples=EDITS // 8 or 25, deadline=None, derandomize=not EDITS, database=None, phases=[Phase.generate])
@given(st.sampled_from([*TEXTS, *["grown", "grown, \\r\\n"] * 8]), st.integers(0, 2**32))
def test_edits_change_what_is_meant_and_undo_gives_every_byte_back(name: str, seed: int) -> None:
    MADE.append(walk(Random(seed), TEXTS[name], 12))  # noqa: S311
