"""What the study designer asks before some steps."""

from __future__ import annotations

from dataclasses import dataclass

from study_app.protocol.source.document import Path


@dataclass(frozen=True, slots=True)
class DeletePrompt:
    """What refers to an element that is to be deleted.

    Attributes
    ----------
    path : tuple of str or int
        The element.
    title : str
        What it is called.
    references : tuple of str
        The places that name it, in words.
    others : tuple of (str, str)
        Id and title of what could be named in its place.
    also : tuple of path
        Others that are deleted with it.
    """

    path: Path
    title: str
    references: tuple[str, ...]
    others: tuple[tuple[str, str], ...] = ()
    also: tuple[Path, ...] = ()
