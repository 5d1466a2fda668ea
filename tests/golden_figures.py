"""Figures of matplotlib as lines of text, for golden files."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import Any

from tests.golden_values import numbers


def figure_lines(figure: Any) -> Iterator[str]:
    """Yield everything that a figure of matplotlib shows: axes with limits and ticks, and each artist with its look."""
    yield f"figure {numbers(figure.get_size_inches())}"
    yield from _artists(one for one in figure.get_children() if one not in figure.axes and one is not figure.patch)
    for axes in figure.axes:
        yield (
            f"axes {axes.get_label()} at {numbers(axes.get_position().bounds)} {axes.get_xscale()} "
            f"{axes.get_yscale()} {axes.get_title(loc='left')}{axes.get_title()} | {axes.get_xlabel()} | "
            f"{axes.get_ylabel()}{'' if axes.axison else ' off'}"
        )
        for axis, ends in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
            labels = [label.get_text() for label in axis.get_ticklabels() if label.get_visible()]
            yield f"  {axis.axis_name} {numbers(ends)} ticks {numbers(axis.get_ticklocs())} {labels}"
        yield f"  spines {[name for name, spine in axes.spines.items() if spine.get_visible()]}"
        held = {axes.xaxis, axes.yaxis, axes.patch, axes.title, *axes.spines.values()}
        shown = (one for one in axes.get_children() if one not in held and one.get_visible())
        yield from (f"  {line}" for line in _artists(shown))


def _artists(artists: Iterable[Any]) -> Iterator[str]:
    """Yield the looks of artists, and for those in a row that look alike what each is and where."""
    told = (one for artist in artists for one in _artist(artist))
    for look, alike in groupby(told, lambda one: one[0]):
        yield f"{look}: {'; '.join(what for _, what in alike)}"


def _artist(artist: Any) -> Iterator[tuple[str, str]]:
    """Yield how an artist looks, and what and where it is; of a legend its handles as well."""
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

    look = f"{type(artist).__name__} {artist.get_gid() or ''} z{artist.get_zorder():g}"
    look += "" if artist.get_alpha() is None else f" alpha {artist.get_alpha():g}"
    match artist:
        case Text():
            if artist.get_text():
                yield (
                    f"{look} {artist.get_ha()} {artist.get_va()} {artist.get_rotation():g} {artist.get_size():g} "
                    f"{artist.get_weight()} {colour(artist.get_color())}",
                    f"{artist.get_text()!r} at {numbers(artist.get_position())}",
                )
        case Line2D():
            yield (
                f"{look} {colour(artist.get_color())} {artist._unscaled_dash_pattern} {artist.get_linewidth():g} "
                f"{artist.get_marker()} {artist.get_markersize():g} {colour(artist.get_markerfacecolor())} "
                f"{artist.get_drawstyle()}",
                f"x {numbers(artist.get_xdata())} y {numbers(artist.get_ydata())}",
            )
        case Patch():
            shape = artist.get_path().transformed(artist.get_patch_transform()).vertices
            yield (
                f"{look} {colour(artist.get_facecolor())} {colour(artist.get_edgecolor())} "
                f"{artist.get_linewidth():g} {artist.get_linestyle()}",
                numbers(shape),
            )
        case Collection():
            shape = [corner for path in artist.get_paths() for corner in path.vertices.ravel()]
            yield (
                f"{look} {colours(artist.get_facecolor())} / {colours(artist.get_edgecolor())} "
                f"{numbers(artist.get_linewidth())} paths {numbers(shape)}",
                f"{numbers(artist.get_offsets())} {'' if artist.get_array() is None else numbers(artist.get_array())}",
            )
        case AxesImage():
            yield f"{look} {artist.get_cmap().name} {numbers(artist.get_extent())}", numbers(artist.get_array())
        case Legend():
            yield look, f"{artist._loc} {[text.get_text() for text in artist.get_texts()]}"
            for handle in artist.legend_handles:
                yield from _artist(handle)
        case _:
            yield look, ""


def stub_png(figure: Any, *_form: object) -> bytes:
    """Return a file that begins as every PNG does, and then holds the lines of a figure."""
    size = [round(inches * 300).to_bytes(4, "big") for inches in figure.get_size_inches()]
    return b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR" + b"".join(size) + "\n".join(figure_lines(figure)).encode()


def figure_of(content: bytes) -> Sequence[str]:
    """Return the lines of a figure in a file of `stub_png`."""
    return content[24:].decode().split("\n")
