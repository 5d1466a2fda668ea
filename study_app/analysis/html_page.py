"""The page and its parts: one HTML file with its style and pictures inside, without scripts."""

import base64
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any, TypeVar

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape
from markupsafe import Markup

from study_app.analysis.page_layout import Picture
from study_app.analysis.results import Failure, Failures

T = TypeVar("T")

LONG = 32
"""Cells of more letters are broken into lines."""

SHORT = 16
"""On paper, cells of more letters are."""

SCALE = 0.4
"""Pixels of the page for one of a figure: one that is two columns of print wide is 860 wide."""


@cache
def _environment() -> Environment:
    """Return the templates; everything in those of HTML is escaped, and nothing may be missing."""
    loader = PackageLoader("study_app.analysis.report", "templates")
    return Environment(loader=loader, autoescape=select_autoescape(), undefined=StrictUndefined, trim_blocks=True)


def render(template: str, **values: Any) -> Markup:
    """Return a template of this package with its values; what is not markup is escaped."""
    return Markup(_environment().get_template(template).render(**values))  # noqa: S704 - the template escapes


def _part(macro: str, *values: object) -> Markup:
    return Markup(getattr(_environment().get_template("parts.html").module, macro)(*values))  # noqa: S704


def heading(level: int, words: str) -> Markup:
    """Return a heading."""
    return _part("heading", level, words)


def paragraph(words: str, kind: str = "") -> Markup:
    """Return a paragraph of ``kind`` (a class of the style)."""
    return _part("paragraph", words, kind)


def attempted(
    failures: Failures, what: str, title: Markup, make: Callable[[], Iterable[str]], *, block: str | None = None
) -> list[str]:
    """Return a part of the page; where it fails its title and why it is missing, and the failure is kept."""
    found = failures.attempt(what, lambda: list(make()), block=block)
    return [title, box([paragraph(f"Not there: {found.why}.")], "care")] if isinstance(found, Failure) else found


def bullets(lines: Iterable[str]) -> Markup:
    """Return a list, empty where there are no lines."""
    return _part("bullets", lines)


def table(head: Sequence[str], rows: Iterable[Sequence[str]], *, words: int = 1, last: int = 0) -> Markup:
    """Return a table whose first ``words`` and ``last`` columns are words and whose others are numbers."""
    kinds = ["" if place < words or place >= len(head) - last else "n" for place in range(len(head))]
    cells = [[(kind or _width(cell), cell) for kind, cell in zip(kinds, row, strict=True)] for row in rows]
    return _part("table", list(zip(kinds, head, strict=True)), cells)


def table_of(
    rows: Iterable[T], *columns: tuple[str, Callable[[T], str]] | None, words: int = 1, last: int = 0
) -> Markup:
    """Return a table of ``rows``; a column is its heading and what makes a cell of a row, None one that is left out."""
    shown = [column for column in columns if column is not None]
    cells = [[cell(row) for _, cell in shown] for row in rows]
    return table([head for head, _ in shown], cells, words=words, last=last)


def _width(words: str) -> str:
    """Return the class of a cell of words; only sentences are broken into lines."""
    return "long" if len(words) > LONG else "words" if len(words) > SHORT else ""


def box(parts: Iterable[Markup], kind: str = "box") -> Markup:
    """Return parts that belong together."""
    return _part("box", parts, kind)


def picture(png: bytes, caption: str) -> Markup:
    """Return a figure with its caption, the picture inside."""
    width = round(SCALE * int.from_bytes(png[16:20]))  # where every PNG says it
    return _part("picture", width, caption, base64.b64encode(png).decode("ascii"))


def drawn(pictures: Mapping[str, Picture], name: str) -> Iterator[Markup]:
    """Yield the figure of this name, where there is one."""
    if name in pictures:
        yield picture(pictures[name].files["png"], pictures[name].caption)
