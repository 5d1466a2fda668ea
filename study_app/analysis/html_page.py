"""HTML of a report: headings, tables and figures of one file that includes its style and pictures, without scripts."""

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
"""Maximum number of characters in a table cell that is not wrapped on screen."""

_SHORT = 16
"""Maximum number of characters in a table cell that is not wrapped on paper."""

_FOLDED = 12
"""The most rows of a table that is not folded."""

_PX_PER_PT = 1.9
"""Pixels for each point of a figure that has enough space."""
_BESIDE_PT = 420
"""The width of a figure that fills the space beside an answer; narrower figures keep the same text size."""
_LEAST_LETTERS_PX = 11
"""The smallest height of text in a figure on screen; a figure without enough space scrolls."""

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
"""The CSS variable of each colour of figures, so that colours follow the light or dark style."""
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
    """Return a text with the z of d_z as a subscript; other values are unchanged."""
    if isinstance(value, Markup) or not isinstance(value, str) or "d_z" not in value:
        return value
    return Markup(with_d_z(Markup.escape(value), "d<sub>z</sub>"))  # noqa: S704 - the text is escaped


def render(template: str, **values: Any) -> Markup:
    """Return a template of this package filled with values; anything that is not markup is escaped."""
    return Markup(_environment().get_template(template).render(**values))  # noqa: S704 - the template escapes


def _render_macro(macro: str, *values: object) -> Markup:
    return Markup(getattr(_environment().get_template("parts.html").module, macro)(*values))  # noqa: S704


def heading(level: int, words: str) -> Markup:
    """Return a heading."""
    return _render_macro("heading", level, words)


def paragraph(words: str, kind: str = "") -> Markup:
    """Return a paragraph of ``kind`` (a class of the style)."""
    return _render_macro("paragraph", words, kind)


def try_part(
    failures: Failures, what: str, title: Markup, make: Callable[[], Iterable[str]], *, block: str | None = None
) -> list[str]:
    """Return a part of the page or, if it fails, its title and the reason; record the failure."""
    part = failures.attempt(what, lambda: list(make()), block=block)
    return [title, box([paragraph(f"Not available: {part.why}.")], "care")] if isinstance(part, Failure) else part


def chunks(parts: Sequence[str]) -> list[list[str]]:
    """Return the parts of a section grouped by heading."""
    groups: list[list[str]] = []
    for part in parts:
        if not groups or part.startswith("<h3"):
            groups.append([])
        groups[-1].append(part)
    return groups


def bullets(lines: Iterable[str]) -> Markup:
    """Return a bullet list; empty without lines."""
    return _render_macro("bullets", lines)


def table(
    head: Sequence[str], rows: Iterable[Sequence[str]], *, words: int = 1, last: int = 0, folded: bool = False
) -> Markup:
    """Return a table whose first ``words`` and ``last`` columns are text and whose others are numbers.

    A table with many rows is always ``folded``.
    """
    kinds = ["" if place < words or place >= len(head) - last else "n" for place in range(len(head))]
    cells = [[(kind or _text_cell_class(cell), cell) for kind, cell in zip(kinds, row, strict=True)] for row in rows]
    return _render_macro("table", list(zip(kinds, head, strict=True)), cells, folded or len(cells) > _FOLDED)


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


def _text_cell_class(words: str) -> str:
    """Return the CSS class of a text cell; only sentences are wrapped."""
    return "long" if len(words) > LONG else "words" if len(words) > _SHORT else ""


def box(parts: Iterable[Markup], kind: str = "box") -> Markup:
    """Return parts in one box; ``kind`` is a class of the style."""
    return _render_macro("box", parts, kind)


def picture(figure: Picture, *, beside: bool = False) -> Markup:
    """Return a figure with its caption, inlined with the page's colours and font.

    The caption of a figure ``beside`` an answer is omitted.
    """
    if "svg" not in figure.files:
        width, png = round(0.4 * int.from_bytes(figure.files["png"][16:20])), figure.files["png"]
        drawing = _render_macro("png", width, figure.caption, base64.b64encode(png).decode("ascii"))
    else:
        drawing = _inline_svg(figure.files["svg"].decode(), figure.caption)
    return _render_macro("picture", drawing, "" if beside else figure.caption)


def _inline_svg(svg: str, caption: str) -> Markup:
    """Return an SVG for inlining, with the page's colours; texts on a coloured background keep theirs."""
    parts = _LETTERS.split(HEAD.sub("", svg))
    parts[::2] = [_COLOUR.sub(lambda match: f"var(--{_VARIABLES[match[0].lower()]})", part) for part in parts[::2]]
    parts[1::2] = [
        _COLOUR.sub(lambda match: f"var(--{_VARIABLES[match[0].lower()]})", part) if "#ffffff" not in part else part
        for part in parts[1::2]
    ]
    width = round(_PX_PER_PT * float(size[1])) if (size := _SIZE.search(svg)) else 600
    proportion = min(100, round(100 * width / (_PX_PER_PT * _BESIDE_PT)))
    svg_tag = size[0] if size else ""
    root_tag = re.sub(r' (?:width|height)="[^"]*"', "", svg_tag, count=2)
    label = Markup.escape(caption)
    least_px = math.ceil(_LEAST_LETTERS_PX / SMALL * float(size[1])) if size else 0
    css = f"width: {width}px; --share: {proportion}%; --least: {least_px}px"
    styled_tag = root_tag.replace("<svg ", f'<svg role="img" aria-label="{label}" style="{css}" ', 1)
    return Markup("".join(parts).replace(svg_tag, styled_tag, 1))  # noqa: S704 - matplotlib escapes its texts


@cache
def font_face(weight: str) -> str:
    """Return a weight of Inter (Regular, Bold) as a data URI, or "" if it is not installed."""
    file = style.FONT_FOLDER / f"Inter-{weight}.ttf"
    return base64.b64encode(file.read_bytes()).decode("ascii") if file.is_file() else ""


def drawn_figure(pictures: Mapping[str, Picture], name: str) -> Iterator[Markup]:
    """Yield the figure with this name, if it exists."""
    if name in pictures:
        yield picture(pictures[name])
