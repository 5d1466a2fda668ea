"""What a figure of answers shows, and answers to draw."""

import re

from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.text import Text

from tests.analysis.conftest import Results


def words(figure: Figure) -> list[str]:
    return [text.get_text() for text in shown(figure)]


def shown(figure: Figure) -> list[Text]:
    return [text for text in figure.findobj(Text) if text.get_text().strip() and text.get_visible()]


def panel(figure: Figure, name: str) -> Axes:
    return next(axes for axes in figure.axes if axes.get_label() == name)


def segments(axes: Axes, row: int) -> dict[int, tuple[float, float, str]]:
    """Level → left edge, width, colour of the bars of a row (from 1)."""
    found = {}
    for patch in axes.patches:
        match = re.fullmatch(rf".*-row{row}-level(\d)", patch.get_gid() or "")
        if match:
            found[int(match[1])] = (patch.get_x(), patch.get_width(), to_hex(patch.get_facecolor()))
    return found


def gids(axes: Axes, ending: str) -> list:
    return [artist for artist in axes.get_children() if re.fullmatch(rf".*-{ending}", artist.get_gid() or "")]


def by_person(results: Results, levels: list[int]) -> None:
    for number, level in enumerate(levels, start=1):
        results.add(f"P{number:03d}", lambda condition, item, level=level: level)
