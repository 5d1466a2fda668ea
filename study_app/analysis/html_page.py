"""The page and its parts: one HTML file with its style and pictures inside, without scripts."""

import base64
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any, TypeVar

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape
from markupsafe import Markup

from study_app import figure_style as style
from study_app.analysis.page_layout import SMALL, Picture
from study_app.analysis.results import Failure, Failures
from study_app.analysis.wording import number, with_d_z

_T = TypeVar("_T")

LONG = 32
"""Cells of more letters are broken into lines."""

_SHORT = 16
"""On paper, cells of more letters are."""

_FOLDED = 12
"""A table of more rows is folded."""

_PX_PER_PT = 1.9
"""Pixels of the page for a point of a figure that has the room."""
_BESIDE_PT = 420
"""Of a figure that fills its place beside an answer; narrower ones do not, so that all texts are equally large."""
_LEAST_LETTERS_PX = 11
"""Height of the smallest letters of a figure on a screen; a figure without the room scrolls."""

_VARIABLES = {
    style.TEXT: "text",
    style.TEXT_SOFT: "soft",
    style.GRID: "grid",
    style.GROUND: "ground",
    style.BORDER: "edge",
    style.AXIS: "axis",
    style.ACCENT: "accent",
    style.BAND: "band",
    style.SECOND: "second",
    style.PARTICIPANT: "person",
    style.WARN: "warn",
    style.WARN_GROUND: "warn-ground",
    style.SEALED_GROUND: "sunk",
    "#ffffff": "paper",
}
"""The colours of figures that the page has by name, since they change with light and dark."""
_COLOUR = re.compile("|".join(_VARIABLES), re.IGNORECASE)
_LETTERS = re.compile(r"(<text.*?</text>)", re.DOTALL)
HEAD = re.compile(r"^.*?(?=<svg)|<metadata>.*?</metadata>", re.DOTALL)
_SIZE = re.compile(r'<svg [^>]*?viewBox="0 0 ([0-9.]+) ([0-9.]+)"[^>]*>')


@cache
def _environment() -> Environment:
    """Return the template environment; HTML templates are escaped, and undefined values raise an error."""
    loader = PackageLoader("study_app.analysis.report", "templates")
    return Environment(
        loader=loader, autoescape=select_autoescape(), undefined=StrictUndefined, trim_blocks=True, finalize=_typeset
    )


def _typeset(value: Any) -> Any:
    """Return a text in which the z of d_z is a subscript; other values are unchanged."""
    if isinstance(value, Markup) or not isinstance(value, str) or "d_z" not in value:
        return value
    return Markup(with_d_z(Markup.escape(value), "d<sub>z</sub>"))  # noqa: S704 - the text is escaped


def render(template: str, **values: Any) -> Markup:
    """Return a template of this package filled with values; anything that is not markup is escaped."""
    return Markup(_environment().get_template(template).render(**values))  # noqa: S704 - the template escapes


def _part(macro: str, *values: object) -> Markup:
    return Markup(getattr(_environment().get_template("parts.html").module, macro)(*values))  # noqa: S704


def heading(level: int, words: str) -> Markup:
    """Return a heading."""
    return _part("heading", level, words)


def paragraph(words: str, kind: str = "") -> Markup:
    """Return a paragraph of ``kind`` (a class of the style)."""
    return _part("paragraph", words, kind)


def try_part(
    failures: Failures, what: str, title: Markup, make: Callable[[], Iterable[str]], *, block: str | None = None
) -> list[str]:
    """Return a part of the page or, if it fails, its title and the reason; the failure is recorded."""
    made = failures.attempt(what, lambda: list(make()), block=block)
    return [title, box([paragraph(f"Not available: {made.why}.")], "care")] if isinstance(made, Failure) else made


def chunks(parts: Sequence[str]) -> list[list[str]]:
    """Return the parts of a section grouped by heading."""
    found: list[list[str]] = []
    for part in parts:
        if not found or part.startswith("<h3"):
            found.append([])
        found[-1].append(part)
    return found


def bullets(lines: Iterable[str]) -> Markup:
    """Return a bullet list; empty without lines."""
    return _part("bullets", lines)


def table(
    head: Sequence[str], rows: Iterable[Sequence[str]], *, words: int = 1, last: int = 0, folded: bool = False
) -> Markup:
    """Return a table whose first ``words`` and ``last`` columns are text and whose others are numbers.

    A table with many rows is always ``folded``.
    """
    kinds = ["" if place < words or place >= len(head) - last else "n" for place in range(len(head))]
    cells = [[(kind or _width(cell), cell) for kind, cell in zip(kinds, row, strict=True)] for row in rows]
    return _part("table", list(zip(kinds, head, strict=True)), cells, folded or len(cells) > _FOLDED)


def table_of(
    rows: Iterable[_T], *columns: tuple[str, Callable[[_T], str]] | None, words: int = 1, last: int = 0
) -> Markup:
    """Return a table of ``rows``; a column is a heading and a function from row to cell, or None to omit it."""
    shown = [column for column in columns if column is not None]
    cells = [[cell(row) for _, cell in shown] for row in rows]
    return table([head for head, _ in shown], cells, words=words, last=last)


def ends_of(interval: Callable[[Any], object], level: float = 0.95) -> tuple[tuple[str, Callable[[Any], str]], ...]:
    """Return two columns with the ends of each row's confidence interval; dashes where it is None."""
    return (
        (f"{100 * level:g} % CI lower", lambda row: number(getattr(interval(row), "low", None))),
        (f"{100 * level:g} % CI upper", lambda row: number(getattr(interval(row), "high", None))),
    )


def _width(words: str) -> str:
    """Return the CSS class of a text cell; only sentences are wrapped."""
    return "long" if len(words) > LONG else "words" if len(words) > _SHORT else ""


def box(parts: Iterable[Markup], kind: str = "box") -> Markup:
    """Return related parts in one box."""
    return _part("box", parts, kind)


def picture(one: Picture, *, beside: bool = False) -> Markup:
    """Return a figure with its caption, inlined with the page's colours and font.

    The caption of a figure ``beside`` an answer is omitted.
    """
    if "svg" not in one.files:
        width, png = round(0.4 * int.from_bytes(one.files["png"][16:20])), one.files["png"]
        drawing = _part("png", width, one.caption, base64.b64encode(png).decode("ascii"))
    else:
        drawing = _inline_svg(one.files["svg"].decode(), one.caption)
    return _part("picture", drawing, "" if beside else one.caption)


def _inline_svg(svg: str, words: str) -> Markup:
    """Return an SVG's drawing with the page's colours; white text and its background are kept."""
    parts = _LETTERS.split(HEAD.sub("", svg))
    parts[::2] = [_COLOUR.sub(lambda match: f"var(--{_VARIABLES[match[0].lower()]})", part) for part in parts[::2]]
    parts[1::2] = [
        _COLOUR.sub(lambda match: f"var(--{_VARIABLES[match[0].lower()]})", part) if "#ffffff" not in part else part
        for part in parts[1::2]
    ]
    width = round(_PX_PER_PT * float(size[1])) if (size := _SIZE.search(svg)) else 600
    share = min(100, round(100 * width / (_PX_PER_PT * _BESIDE_PT)))
    view = size[0] if size else ""
    root = re.sub(r' (?:width|height)="[^"]*"', "", view, count=2)
    label = Markup.escape(words)
    least = math.ceil(_LEAST_LETTERS_PX / SMALL * float(size[1])) if size else 0
    look = f"width: {width}px; --share: {share}%; --least: {least}px"
    shown = root.replace("<svg ", f'<svg role="img" aria-label="{label}" style="{look}" ', 1)
    return Markup("".join(parts).replace(view, shown, 1))  # noqa: S704 - matplotlib escapes its texts


@cache
def font_face(weight: str) -> str:
    """Return a weight of Inter (Regular, Bold) as a data URI, or "" if it is not installed."""
    file = style.FONT_FOLDER / f"Inter-{weight}.ttf"
    return base64.b64encode(file.read_bytes()).decode("ascii") if file.is_file() else ""


def drawn_figure(pictures: Mapping[str, Picture], name: str) -> Iterator[Markup]:
    """Yield the figure with this name, if it exists."""
    if name in pictures:
        yield picture(pictures[name])
