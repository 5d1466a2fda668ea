"""What is asked for in the study designer: each a step of undo."""

from __future__ import annotations

from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, Literal, TypeAlias

from study_app.protocol.source.document import Path


@dataclass(frozen=True, slots=True)
class SetValue:
    """Give a key or entry a value; several while one field is typed in are one step."""

    path: Path
    value: Any
    typing: bool = False


@dataclass(frozen=True, slots=True)
class SetText:
    """Give a text in one language."""

    path: Path
    language: str
    text: str


@dataclass(frozen=True, slots=True)
class LeaveText:
    """Say that a text is left: a new element takes the id of its text."""

    path: Path


@dataclass(frozen=True, slots=True)
class RemoveKey:
    """Remove a key or an entry of a list."""

    path: Path


@dataclass(frozen=True, slots=True)
class AddKey:
    """Write an optional key with its default or an initial value."""

    path: Path


@dataclass(frozen=True, slots=True)
class AddEntry:
    """Add an entry at the end of a list: the value, or where it is None an initial one."""

    path: Path
    value: Any = None


@dataclass(frozen=True, slots=True)
class SwitchKind:
    """Give a table another kind."""

    path: Path
    kind: str | None


@dataclass(frozen=True, slots=True)
class SwitchKey:
    """Give one key in place of another one of the same table, of two of which exactly one is given."""

    path: Path
    to: str


@dataclass(frozen=True, slots=True)
class AddElement:
    """Add an element to a section of tables or a list of tables, of a kind where there are several.

    ``kind`` is the key that tells kinds apart with its value; () leaves it out.
    """

    section: Path
    kind: tuple[()] | tuple[str, str] = ()


@dataclass(frozen=True, slots=True)
class AddNamed:
    """Add an element to a section and name it: in the reference at ``path``, or at the end of the list there."""

    path: Path
    section: str


@dataclass(frozen=True, slots=True)
class AddInstrument:
    """Add a questionnaire that is a standard one."""

    name: str


@dataclass(frozen=True, slots=True)
class ChangeLanguage:
    """Add a language to every text, copy the first language's texts where it has none, or take it away."""

    how: Literal["add", "copy", "remove"]
    language: str


@dataclass(frozen=True, slots=True)
class DuplicateElement:
    """Copy an element right after itself; ``also`` are others that are copied with it.

    ``stays`` says that the form stays at its element, as where entries of a list in it are copied.
    """

    path: Path
    also: tuple[Path, ...] = ()
    stays: bool = False


@dataclass(frozen=True, slots=True)
class MakeSeries:
    """Copy an element once for each value of the number ``field``."""

    path: Path
    field: Path
    values: tuple[int | float, ...]


@dataclass(frozen=True, slots=True)
class MoveElement:
    """Move an element among its neighbours, by so many places; ``also`` are others that move with it."""

    path: Path
    by: int
    also: tuple[Path, ...] = ()


@dataclass(frozen=True, slots=True)
class MoveTo:
    """Move entries of a list together before the one at the index ``to``; its length stands for the end.

    ``stays`` says that the form stays at its element.
    """

    entries: tuple[Path, ...]
    to: int
    stays: bool = False


@dataclass(frozen=True, slots=True)
class Paste:
    """Paste a text after an element: elements as TOML, or lines that become questions."""

    path: Path
    text: str


@dataclass(frozen=True, slots=True)
class DeleteElement:
    """Delete an element: with all that needs it, with another one in its place, or leaving gaps.

    ``also`` are others that are deleted with it.
    """

    path: Path
    how: Literal["all", "other", "gaps"] = "gaps"
    other: str = ""
    also: tuple[Path, ...] = ()


@dataclass(frozen=True, slots=True)
class RenameElement:
    """Give an element another id, and all that name it."""

    path: Path
    name: str


@dataclass(frozen=True, slots=True)
class RetypeFile:
    """Give the file another text, as the pane shows it."""

    text: str


@dataclass(frozen=True, slots=True)
class Several:
    """Several requests, one after the other, as one step."""

    words: str
    requests: tuple[Request, ...]


Task: TypeAlias = Literal[
    "select", "join", "write", "back", "find", "undo", "redo", "save", "open", "new", "begin", "banner", "add", "copy",
    "paste", "delete", "series", "judge id", "repair", "repairs",
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class Do:
    """A task that is no step of the study, and what it takes: ``Do("select", (path,))``."""

    what: Task
    arguments: tuple[Any, ...] = ()


@dataclass(frozen=True, slots=True)
class GoTo:
    """Select an element and give the keyboard to one of its fields; a step of the place, not of the study."""

    element: Path
    field: Path


Request: TypeAlias = (
    SetValue | SetText | LeaveText | RemoveKey | AddKey | AddEntry | SwitchKind | SwitchKey | AddElement | AddNamed
    | AddInstrument | ChangeLanguage | DuplicateElement | MakeSeries | MoveElement | MoveTo | Paste | DeleteElement
    | RenameElement | RetypeFile | Several
)  # fmt: skip


def with_path(asked: Any, before: Path, after: Path) -> Any:
    """Return a request, or a path, in which the path of an element is another one, as after a new id."""
    if isinstance(asked, tuple):
        if asked[: len(before)] == before:
            return (*after, *asked[len(before) :])
        return tuple(with_path(one, before, after) for one in asked)
    if is_dataclass(asked) and not isinstance(asked, type):
        parts = {part.name: getattr(asked, part.name) for part in fields(asked)}
        return replace(asked, **{name: with_path(value, before, after) for name, value in parts.items()})
    return asked
