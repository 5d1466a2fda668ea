"""What a page draws: its pixels, and its words with their places, recorded while it paints itself."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QImage, QPainter
from PySide6.QtWidgets import QApplication, QLabel, QWidget

from study_app.gui.participant.pages import page_widget

MODULES = tuple(
    f"study_app.gui.participant.{name}"
    for name in (
        "tank_widget",
        "forms.foot",
        "forms.option_button",
        "forms.question_words",
        "pages.column_labels",
        "pages.key_caps",
        "pages.language_switch",
        "pages.notices",
        "pages.progress_line",
        "pages.reading_page",
        "pages.text_page",
    )
)


@dataclass(frozen=True)
class Drawn:
    """A text, where it was allowed to be and where its ink is, in the coordinates of the window [px]."""

    widget: QWidget
    text: str
    room: QRectF
    ink: QRectF


class Recorder(QPainter):
    """A painter that keeps which words it draws and where."""

    def __init__(self, widget: QWidget, kept: list[Drawn]) -> None:
        super().__init__(widget)
        self.setRenderHint(QPainter.RenderHint.Antialiasing)
        self.setLayoutDirection(widget.layoutDirection())
        self._widget = widget
        self._kept = kept

    def drawText(self, *arguments: Any) -> Any:  # noqa: N802
        place, flags, text = arguments
        assert isinstance(place, QRectF)
        flags = int(flags)
        ink = self.boundingRect(place, flags | int(Qt.TextFlag.TextDontClip), text)
        origin = QPointF(self._widget.mapTo(self._widget.window(), self._widget.rect().topLeft()))
        if text:
            self._kept.append(Drawn(self._widget, text, place.translated(origin), ink.translated(origin)))
        super().drawText(place, flags, text)


@contextmanager
def recorded() -> Iterator[list[Drawn]]:
    """Keep what is drawn meanwhile."""
    kept: list[Drawn] = []
    before = {}
    for name in MODULES:
        module = sys.modules[name]
        if hasattr(module, "page_painter"):
            before[name] = page_widget.page_painter
            module.page_painter = lambda widget: Recorder(widget, kept)  # type: ignore[attr-defined]
    try:
        yield kept
    finally:
        for name, painter in before.items():
            sys.modules[name].page_painter = painter  # type: ignore[attr-defined]


def drawn_by(window: QWidget) -> list[Drawn]:
    """Return all words on a window: those that are painted, and those of its labels."""
    QApplication.processEvents()
    with recorded() as kept:
        window.grab()
    found = list(kept)
    for label in window.findChildren(QLabel):
        if label.isVisible() and label.text():
            place = QRectF(label.rect()).translated(QPointF(label.mapTo(window, label.rect().topLeft())))
            found.append(Drawn(label, label.text(), place, place))
    return found


def pixels(image: QImage) -> np.ndarray:
    """Return an image as (height, width, 3) of 0 … 255."""
    image = image.convertToFormat(QImage.Format.Format_RGB32)
    flat = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine() // 4, 4)
    return flat[:, : image.width(), :3].copy()


def shown(widget: QWidget) -> np.ndarray:
    return pixels(widget.grab().toImage())
