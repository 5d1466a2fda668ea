"""Which lines of a text are on the screen, and where."""

from PySide6.QtWidgets import QPlainTextEdit


def visible_lines(text: QPlainTextEdit) -> list[tuple[int, float, float]]:
    """Return the visible lines: the number of each from 0, how far down it is, and its height [px]."""
    found = []
    block, offset = text.firstVisibleBlock(), text.contentOffset()
    while block.isValid():
        place = text.blockBoundingGeometry(block).translated(offset)
        if place.top() > text.viewport().height():
            break
        found.append((block.blockNumber(), place.top(), place.height()))
        block = block.next()
    return found
