"""Outputs as lines of text, compared with reviewed files that ``--regenerate`` writes anew."""

import csv
import html
import io
import json
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from tests import golden_text

CHANGING = re.compile(
    r"\d{4}-\d\d-\d\d(?:[T ]\d\d:\d\d(?::\d\d(?:\.\d+)?)?(?:Z|[+-]\d\d:\d\d)?)?"
    r"|\b\d+\.\d+\.\d+\b|\b(?<!\.)[0-9a-f]{12,}\b"
)
"""Dates, versions and hashes."""


def compare(kept: Path, found: Iterable[str], config: pytest.Config, **tolerance: float) -> None:
    """Compare lines without dates, versions and hashes with a file, or write it."""
    golden_text.compare(kept, (CHANGING.sub("*", line) for line in found), config, **tolerance)


def page_lines(text: str) -> Iterator[str]:
    """Yield a page's headings, paragraphs and rows of tables, without style and pictures."""
    body = re.sub(r"<style.*?</style>|<img[^>]*>", "", text, flags=re.S)
    for row in re.split(r"</?(?:tr|p|h\d|li|div|section|title|summary|details|caption|figcaption)\b[^>]*>", body):
        cells = [re.sub(r"<[^>]+>|\s+", " ", cell).strip() for cell in re.split(r"</t[dh]>", row)]
        if any(cells):
            yield html.unescape(" | ".join(cells).strip(" |"))


def leaves(place: str, value: Any) -> Iterator[str]:
    """Yield each value of a JSON text with its place; elements of lists by their name, if they have one."""
    if isinstance(value, list):
        named = all(isinstance(below, dict) and "name" in below for below in value)
        value = {below["name"] if named else number: below for number, below in enumerate(value)}
    if isinstance(value, dict) and value:
        for name, below in value.items():
            yield from leaves(f"{place}/{name}", below)
    else:
        yield f"{place}: {value!r}"


def file_lines(name: str, content: bytes) -> Iterator[str]:
    """Yield the texts, cells and values of an output; a table by its columns, those that are empty left out."""
    text = content.decode()
    match name.rpartition(".")[2]:
        case "html":
            yield from page_lines(text)
        case "json":
            yield from rows_of(json.loads(text))
        case "csv":
            for head, *cells in zip(*csv.reader(io.StringIO(text)), strict=True):
                if set(cells) - {"n/a", ""}:
                    yield f"{head}: {cells[0]} (all {len(cells)})" if len(set(cells)) == 1 else f"{head}: {cells}"
        case _:
            yield from text.splitlines()


def rows_of(value: Any, place: str = "") -> Iterator[str]:
    """Yield the values of a JSON text with their place: an object's plain values, or a list of these, in one line."""
    if isinstance(value, list):
        value = dict(enumerate(value))
    plain = {name: one for name, one in value.items() if not isinstance(one, dict | list) or _is_flat(one)}
    if plain:
        yield f"{place}: " + ", ".join(f"{name}={_rounded(one)}" for name, one in plain.items())
    for name, one in value.items():
        if name not in plain:
            yield from rows_of(one, f"{place}/{name}")


def _is_flat(value: Any) -> bool:
    return not value or (isinstance(value, list) and not any(isinstance(one, dict | list) for one in value))


def _rounded(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_rounded, value))}]"
    return f"{value:.7g}" if isinstance(value, float) else repr(value)


def told(value: Any) -> str:
    """Return a value with 7 significant digits: a number, an array, a sequence, a mapping or a dataclass."""
    fields = getattr(value, "__dataclass_fields__", None)
    if fields is not None and not isinstance(value, type):
        return f"{type(value).__name__}({', '.join(f'{name}={told(getattr(value, name))}' for name in fields)})"
    if hasattr(value, "tolist"):
        return told(value.tolist())
    if isinstance(value, float):
        return f"{0.0 if abs(value) < 1e-14 else value:.7g}"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{told(name)}: {told(one)}' for name, one in value.items())}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(told, value))}]"
    return repr(value)


def numbers_told(values: Any, most: int = 16) -> str:
    """Return numbers with 5 significant digits; of more than ``most``: count, ends, sum, and sum by place."""
    import numpy as np

    flat = np.ma.filled(np.ma.asarray(values, float), np.nan).ravel()
    if len(flat) > most:
        known = np.nan_to_num(flat)
        flat = [len(flat), known.min(), known.max(), known.sum(), known @ np.arange(len(known)) / len(known)]
    return " ".join(f"{round(one, 7) + 0.0:.5g}" for one in flat)


def figure_lines(figure: Any) -> Iterator[str]:
    """Yield everything that a figure of matplotlib shows: axes with limits and ticks, and each artist with its look."""
    yield f"figure {numbers_told(figure.get_size_inches())}"
    for artist in figure.get_children():
        if artist not in figure.axes and artist is not figure.patch:
            yield from _artist(artist)
    for axes in figure.axes:
        yield (
            f"axes {axes.get_label()} at {numbers_told(axes.get_position().bounds)} {axes.get_xscale()} "
            f"{axes.get_yscale()} {axes.get_title(loc='left')}{axes.get_title()} | {axes.get_xlabel()} | "
            f"{axes.get_ylabel()}{'' if axes.axison else ' off'}"
        )
        for axis, ends in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
            labels = [label.get_text() for label in axis.get_ticklabels() if label.get_visible()]
            yield f"  {axis.axis_name} {numbers_told(ends)} ticks {numbers_told(axis.get_ticklocs())} {labels}"
        shown = [name for name, spine in axes.spines.items() if spine.get_visible()]
        yield f"  spines {shown}"
        held = {axes.xaxis, axes.yaxis, axes.patch, axes.title, *axes.spines.values()}
        for artist in axes.get_children():
            if artist not in held and artist.get_visible():
                yield from _artist(artist, "  ")


def _artist(artist: Any, indent: str = "") -> Iterator[str]:
    from matplotlib.collections import Collection
    from matplotlib.colors import to_hex
    from matplotlib.image import AxesImage
    from matplotlib.legend import Legend
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch
    from matplotlib.text import Text

    def colour(value: Any) -> str:
        return value if isinstance(value, str) else to_hex(value, keep_alpha=True)

    def colours(values: Any) -> str:
        return " ".join(dict.fromkeys(map(colour, values)))

    look = f"{indent}{type(artist).__name__} {artist.get_gid() or ''} z{artist.get_zorder():g}"
    look += "" if artist.get_alpha() is None else f" alpha {artist.get_alpha():g}"
    match artist:
        case Text():
            if artist.get_text():
                yield (
                    f"{look} {artist.get_text()!r} at {numbers_told(artist.get_position())} {artist.get_ha()} "
                    f"{artist.get_va()} {artist.get_rotation():g} {artist.get_size():g} {artist.get_weight()} "
                    f"{colour(artist.get_color())}"
                )
        case Line2D():
            yield (
                f"{look} {colour(artist.get_color())} {artist._unscaled_dash_pattern} {artist.get_linewidth():g} "
                f"{artist.get_marker()} {artist.get_markersize():g} {colour(artist.get_markerfacecolor())} "
                f"{artist.get_drawstyle()} x {numbers_told(artist.get_xdata())} y {numbers_told(artist.get_ydata())}"
            )
        case Patch():
            shape = artist.get_path().transformed(artist.get_patch_transform()).vertices
            yield (
                f"{look} {colour(artist.get_facecolor())} {colour(artist.get_edgecolor())} {artist.get_linewidth():g} "
                f"{artist.get_linestyle()} {numbers_told(shape)}"
            )
        case Collection():
            shape = [corner for path in artist.get_paths() for corner in path.vertices.ravel()]
            yield (
                f"{look} {colours(artist.get_facecolor())} / {colours(artist.get_edgecolor())} "
                f"{numbers_told(artist.get_linewidth())} {numbers_told(artist.get_offsets())} paths "
                f"{numbers_told(shape)}{'' if artist.get_array() is None else ' ' + numbers_told(artist.get_array())}"
            )
        case AxesImage():
            look += f" {artist.get_cmap().name} {numbers_told(artist.get_extent())}"
            yield f"{look} {numbers_told(artist.get_array())}"
        case Legend():
            yield f"{look} {artist._loc} {[text.get_text() for text in artist.get_texts()]}"
            for handle in artist.legend_handles:
                yield from _artist(handle, f"{indent}  ")
        case _:
            yield look


def stub_png(figure: Any, *_form: object) -> bytes:
    """Return a file that begins as every PNG does, and then holds the lines of a figure."""
    size = [round(inches * 300).to_bytes(4, "big") for inches in figure.get_size_inches()]
    return b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR" + b"".join(size) + "\n".join(figure_lines(figure)).encode()


def figure_of(content: bytes) -> Sequence[str]:
    """Return the lines of a figure in a file of `stub_png`."""
    return content[24:].decode().split("\n")
