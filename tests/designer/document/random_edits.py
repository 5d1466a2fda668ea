"""Random edits of a text, and checks after each that are independent of the writer.

The document is the one that is meant; no other value is written in another way; comments stay with what they belong to.
"""

import re
import tomllib
from collections import Counter
from random import Random
from typing import Any

from study_app.designer.document.toml_edits import (
    Duplicate,
    Edit,
    Insert,
    Move,
    Rename,
    Set,
    Unset,
    intended_document,
    is_same_value,
)
from study_app.protocol.source.document import Node, Path, scan_nodes

_TOKENS = re.compile(
    r'"""(?:\\.|[^\\])*?"""(?!")'
    r"|'''.*?'''(?!')"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'"
    r"|(?P<comment>#[^\r\n]*)",
    re.DOTALL,
)
FREE: Path = ("(free)",)


def owners(text: str) -> Counter[tuple[Path, str]]:
    """Count the comments of a text by their owner's path, or `FREE` without an owner, and their text."""
    nodes = scan_nodes(text)
    comments: Counter[tuple[Path, str]] = Counter()
    for match in _TOKENS.finditer(text):
        if match["comment"]:
            comments[_owner(text, nodes, match.start()), match["comment"].rstrip()] += 1
    return comments


def _owner(text: str, nodes: tuple[Node, ...], at: int) -> Path:
    line = text.rfind("\n", 0, at) + 1
    if text[line:at].strip():
        ended = [node for node in nodes if line < node.end <= at]
        begun = [node for node in nodes if line <= node.start < at]
        return (
            max(ended, key=lambda node: node.end)
            if ended
            else begun[-1]
            if begun
            else Node(kind="key", path=FREE, parts=(), start=0, value=0, end=0)
        ).path
    rest = text[at:].splitlines()
    if re.match(r"#\s*[-=*#~]{3,}", rest[0]):
        return FREE
    position = at
    for row in text[at:].splitlines(keepends=True):
        stripped = row.strip()
        if not stripped or re.match(r"#\s*[-=*#~]{3,}", stripped):
            return FREE
        if not stripped.startswith("#"):
            start = position + (len(row) - len(row.lstrip())) if position != at else at
            beginning = [node for node in nodes if node.start == start]
            return beginning[0].path if beginning else FREE
        position += len(row)
    return FREE


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
    return [inner_path for key, value in inner for inner_path in ((*path, key), *paths(value, (*path, key)))]


def at(document: Any, path: Path) -> Any:
    """Return the value at a path of a document."""
    for step in path:
        document = document[step]
    return document


def edit_of(random: Random, text: str) -> Edit:
    """Return a random edit of a text, which may be invalid; every second one concerns keys with comments."""
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
        naming = tuple(
            reference for reference in known if at(document, reference) == path[-1] and reference[: len(path)] != path
        )
        choices += [Rename(path, name, naming), Set((*path[:-1], name), new, random.choice([None, path[-1]]))]
    if isinstance(value, dict):
        choices += [Set((*path, name), new, random.choice([None, *value])), Set((*path, name, "inner"), new)]
    if isinstance(value, list):
        choices.append(Insert((*path, len(value)), new))
    return random.choice(choices)


def path_after(path: Path, edit: Edit) -> Path | None:
    """Return the path after an edit, or None if the edit may affect its comments."""
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
    """Check that each comment has moved with its owner."""
    old, new = owners(before), owners(after)
    for (path, comment), count in old.items():
        if path == FREE:
            continue
        moved = path_after(path, edit)
        if moved is not None:
            assert new[moved, comment] >= count, (path, moved, comment)
        elif isinstance(edit, Unset):
            everywhere = [sum(n for (_, words), n in comments.items() if words == comment) for comments in (old, new)]
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
    """Return the notation of each scalar value."""
    nodes = [node for node in scan_nodes(text) if node.kind in {"key", "pair", "entry"}]
    inner = {node.path[:length] for node in nodes for length in range(len(node.path))}
    return {node.path: text[node.value : node.end] for node in nodes if node.path not in inner}


def unmeant_changes(before: str, after: str, edit: Edit) -> list[Path]:
    """Return the values that an edit does not concern but whose notation changed."""
    old, new = values_of(before), values_of(after)
    concerned = {edit.path[:length] for length in range(len(edit.path))}
    concerned |= set(edit.references) if isinstance(edit, Rename) else set()
    places = {path: path_after(path, edit) for path in old if path not in concerned}
    return [path for path, place in places.items() if place is not None and new.get(place) != old[path]]


def holds_nothing(edit: Edit) -> bool:
    """Return whether an edit may leave an empty table, which a text does not show."""
    return isinstance(edit, Unset) or (isinstance(edit, Set) and "{}" in str(edit.value))


def check_edit(before: str, after: str, edit: Edit) -> None:
    """Check the text after an edit against the one before."""
    meant = intended_document(tomllib.loads(before), edit)
    assert is_same_value(tomllib.loads(after), meant) or holds_nothing(edit)
    check_comments(before, after, edit)
    assert not unmeant_changes(before, after, edit)
