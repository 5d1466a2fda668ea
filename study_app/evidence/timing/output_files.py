"""What a measurement of timing leaves in a folder: the same texts, tables and pictures, whichever it was."""

from pathlib import Path

from matplotlib.figure import Figure

from study_app.figure_style import PLOT_SETTINGS, file_bytes
from study_app.store.atomic import write_file


def write_report(to: Path, name: str, texts: dict[str, str], figure: Figure, title: str) -> tuple[Path, ...]:
    """Write texts by their endings, and a figure as PNG and SVG, into the folder ``to``; return the files.

    Raises
    ------
    StoreError
        A file cannot be written.
    """
    contents = {ending: text.encode() for ending, text in texts.items()}
    contents |= {ending: file_bytes(figure, ending, title, PLOT_SETTINGS) for ending in ("png", "svg")}
    for ending, content in contents.items():
        write_file(to / f"{name}.{ending}", content)
    return tuple(to / f"{name}.{ending}" for ending in contents)
