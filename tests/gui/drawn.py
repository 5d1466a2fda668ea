"""The drawing of a page: its pixels, and its texts with their positions, recorded while it is painted."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QImage, QPainter
from PySide6.QtWidgets import QApplication, QLabel, QWidget


@dataclass(frozen=True)
class Drawn:
    """A text, where it was allowed to be and where its ink is, in the coordinates of the window [px]."""

    widget: QWidget
    text: str
    room: QRectF
    ink: QRectF


class Recorder(QPainter):
    """A painter that records the texts that it draws and their positions."""

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
    """Record the texts that are drawn meanwhile."""
    kept: list[Drawn] = []
    painting = [
        module
        for name, module in sys.modules.items()
        if name.startswith("study_app.gui.participant.") and hasattr(module, "page_painter")
    ]
    with pytest.MonkeyPatch.context() as patch:
        for module in painting:
            patch.setattr(module, "page_painter", lambda widget: Recorder(widget, kept))
        yield kept


def drawn_by(window: QWidget) -> list[Drawn]:
    """Return all texts of a window: painted ones, and those of labels."""
    QApplication.processEvents()
    with recorded() as kept:
        window.grab()
    texts = list(kept)
    for label in window.findChildren(QLabel):
        if label.isVisible() and label.text():
            place = QRectF(label.rect()).translated(QPointF(label.mapTo(window, label.rect().topLeft())))
            texts.append(Drawn(label, label.text(), place, place))
    return texts


def pixels(image: QImage) -> np.ndarray:
    """Return an image as (height, width, 3) of 0 … 255."""
    image = image.convertToFormat(QImage.Format.Format_RGB32)
    flat = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine() // 4, 4)
    return flat[:, : image.width(), :3].copy()


def grabbed_pixels(widget: QWidget) -> np.ndarray:
    return pixels(widget.grab().toImage())
