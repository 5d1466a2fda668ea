"""The small pictures of the three answers of the first page."""

from collections.abc import Callable, Sequence
from typing import Final

from study_app import figure_style as style
from study_app.analysis.figures.page_layout import Sheet

WIDTH_PT: Final = 264.0
HEIGHT_PT: Final = 150.0
FOOT_PT: Final = 24.0


@style.own_settings()
def draw(picture: Callable[[Sheet], str | None]) -> tuple[bytes, str] | None:
    """Return the picture of an answer as PNG, and what it shows in words; None where there is nothing to show."""
    sheet = Sheet(WIDTH_PT, HEIGHT_PT, style.fonts_for("png"))
    words = picture(sheet)
    return None if words is None else (style.file_bytes(sheet.figure, "png", words), words)


def foot(sheet: Sheet, words: str) -> None:
    """Write the line under a picture."""
    lines: Sequence[str] = sheet.wrap(words, WIDTH_PT - 8, 8)
    for number, line in enumerate(reversed(lines)):
        sheet.text(4, HEIGHT_PT - 4 - 9.5 * number, line, size=8, colour=style.TEXT_SOFT)
