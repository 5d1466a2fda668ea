"""The list of trial designs, with a picture of each kind."""

from collections.abc import Sequence
from typing import Final

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPen, QPixmap

from study_app.designer.document.fields import default_designs
from study_app.gui.theme import Coloured, Theme, font
from study_app.gui.widgets import Choice
from study_app.protocol.trials import Design

_SIDE_PX, _GAP_PX, _RATIO = 14, 4, 3
_SIZE: Final = QSize(5 * _SIDE_PX + 4 * _GAP_PX, _SIDE_PX)  # up to four intervals and the reply
_REPLIES: Final = {"choice": "?", "number": "#", "setting": "↕"}
_SIGNS: Final = {"samedifferent": "=", "oddity": "≠"}
"""Reply signs of designs whose question is not which interval has more of something."""


class DesignList(Coloured, Choice):
    """A choice between designs; the picture of a kind shows its intervals, one of which differs, and its reply."""

    def __init__(self) -> None:
        super().__init__()
        self._kinds: Sequence[str | None] = ()
        self.setIconSize(_SIZE)

    def show_pictures(self, kinds: Sequence[str | None]) -> None:
        """Show the picture of each entry that is a kind of design."""
        self._kinds = tuple(kinds)
        self.apply_theme(self.theme)

    def apply_theme(self, theme: Theme) -> None:
        for index, kind in enumerate(self._kinds):
            if (design := default_designs().get(str(kind))) is not None:
                self.setItemIcon(index, QIcon(_design_pixmap(design, theme)))


def _design_pixmap(design: Design, theme: Theme) -> QPixmap:
    """Draw one trial: a square for each interval, filled for the comparison, and the sign of the reply."""
    pixmap = QPixmap(_SIZE * _RATIO)
    pixmap.setDevicePixelRatio(_RATIO)
    pixmap.fill(Qt.GlobalColor.transparent)
    painter = QPainter(pixmap)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    square = QRectF(1, 1, _SIDE_PX - 2, _SIDE_PX - 2)
    *_, arrangement = filter(any, design.arrangements)  # the last arrangement with a comparison
    for is_comparison in arrangement:
        painter.setPen(QPen(QColor(theme.accent), 1.4))
        painter.setBrush(QColor(theme.accent if is_comparison else theme.surface))
        painter.drawRoundedRect(square, 3, 3)
        square.translate(_SIDE_PX + _GAP_PX, 0)
    painter.setPen(QColor(theme.text2))
    painter.setFont(font("small", weight=600))
    reply = QRectF(square.left(), 0, 2 * _SIDE_PX, _SIDE_PX)
    painter.drawText(reply, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter,
                     _SIGNS.get(design.kind, _REPLIES[design.reply]))  # fmt: skip
    painter.end()
    return pixmap
