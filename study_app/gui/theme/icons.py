"""Icons as painter paths on a 24 × 24 grid, drawn at the resolution of the screen in any colour.

A path is a string of commands: ``M x y`` moves, ``L x y`` draws a line, ``C`` and ``Q`` draw curves, ``Z`` closes,
``O x y r`` adds a circle and ``R x y w h r`` a rounded rectangle. After ``fill``, paths are filled instead of stroked.
"""

from functools import cache

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPainterPath, QPen, QPixmap

GRID = 24.0
_STROKE = 1.75
_RATIOS = (1.0, 1.25, 1.5, 1.75, 2.0, 3.0)

PATHS = {
    "drop": "M 12 3 C 12 3 6 9.4 6 14.3 C 6 17.7 8.7 20.5 12 20.5 C 15.3 20.5 18 17.7 18 14.3 C 18 9.4 12 3 12 3 Z",
    "home": "M 4 11 L 12 4 L 20 11 M 6 9.5 L 6 20 L 18 20 L 18 9.5 M 10 20 L 10 14 L 14 14 L 14 20",
    "bars": "M 6 20 L 6 14 M 12 20 L 12 4 M 18 20 L 18 10",
    "sliders": "M 5 20 L 5 14 M 5 10 L 5 4 M 12 20 L 12 12 M 12 8 L 12 4 M 19 20 L 19 16 M 19 12 L 19 4 "
    "M 2.5 14 L 7.5 14 M 9.5 8 L 14.5 8 M 16.5 16 L 21.5 16",
    "device": "M 3 5 L 21 5 M 5 5 L 9.7 14.2 M 19 5 L 14.3 14.2 M 12 5 L 12 13 M 8.5 5 L 11 9 M 15.5 5 L 13 9 "
    "O 12 16.5 3.4",
    "screen": "R 3 4 18 12.5 2 M 12 16.5 L 12 20 M 8 20 L 16 20",
    "check": "M 5 12.6 L 9.8 17.2 L 19 7.4",
    "clock": "O 12 12 9 M 12 7 L 12 12 L 15.4 14",
    "warning": "M 12 4.2 C 12.7 4.2 13.2 4.6 13.5 5.1 L 21.2 18 C 21.9 19.2 21.1 20.4 19.8 20.4 L 4.2 20.4 "
    "C 2.9 20.4 2.1 19.2 2.8 18 L 10.5 5.1 C 10.8 4.6 11.3 4.2 12 4.2 Z M 12 9.8 L 12 13.8 fill O 12 16.9 1.1",
    "info": "O 12 12 9 M 12 11.2 L 12 16.4 fill O 12 7.9 1.1",
    "question": "O 12 12 9 M 9.2 9.6 C 9.3 8 10.4 7.1 12 7.1 C 13.7 7.1 14.8 8.1 14.8 9.5 C 14.8 11.4 12 11.6 12 13.6 "
    "fill O 12 16.8 1.1",
    "cross": "M 6.5 6.5 L 17.5 17.5 M 17.5 6.5 L 6.5 17.5",
    "minus": "M 6 12 L 18 12",
    "plus": "M 12 5.5 L 12 18.5 M 5.5 12 L 18.5 12",
    "ring": "O 12 12 7",
    "lock": "R 4.5 10.5 15 10 2.5 M 8 10.5 L 8 7.5 C 8 5.2 9.8 3.5 12 3.5 C 14.2 3.5 16 5.2 16 7.5 L 16 10.5",
    "eye_off": "M 9.9 5.7 C 10.6 5.6 11.3 5.5 12 5.5 C 18 5.5 21.5 12 21.5 12 C 21 13 20.2 14.1 19.2 15.1 "
    "M 14.1 14.2 C 13.5 14.7 12.8 15 12 15 C 10.3 15 9 13.7 9 12 C 9 11.2 9.3 10.4 9.9 9.9 "
    "M 6.5 7.1 C 3.9 8.9 2.5 12 2.5 12 C 2.5 12 6 18.5 12 18.5 C 13.9 18.5 15.5 17.9 16.9 17 M 3.5 3.5 L 20.5 20.5",
    "play": "M 7 5.2 C 7 4.4 7.8 4 8.5 4.4 L 18.8 11.2 C 19.4 11.6 19.4 12.4 18.8 12.8 L 8.5 19.6 "
    "C 7.8 20 7 19.6 7 18.8 Z",
    "pause": "R 6 5 4 14 1.2 R 14 5 4 14 1.2",
    "repeat": "M 4 4.5 L 4 9.5 L 9 9.5 M 4.4 9.3 C 5.8 6.3 8.7 4.3 12.1 4.3 C 16.5 4.3 20 7.8 20 12.1 "
    "C 20 16.5 16.5 20 12.1 20 C 9 20 6.3 18.2 5 15.6",
    "pen": "M 4 20 L 5.2 15.4 L 15.9 4.7 C 16.8 3.8 18.2 3.8 19.1 4.7 C 20 5.6 20 7 19.1 7.9 L 8.4 18.6 L 4 20 Z "
    "M 13 20 L 20 20",
    "flag": "M 5 21 L 5 4.5 M 5 5 C 8 3 10.5 3.4 12.5 4.6 C 14.5 5.8 16.6 5.8 19 4.6 L 19 14 "
    "C 16.6 15.2 14.5 15.2 12.5 14 C 10.5 12.8 8 12.4 5 14.4",
    "stop": "M 8.2 3 L 15.8 3 L 21 8.2 L 21 15.8 L 15.8 21 L 8.2 21 L 3 15.8 L 3 8.2 Z fill R 8.6 8.6 6.8 6.8 0.8",
    "moon": "M 19.6 14.2 C 18.6 14.6 17.6 14.8 16.5 14.8 C 12.3 14.8 9.1 11.5 9.1 7.4 C 9.1 6.1 9.4 5 10 4 "
    "C 6.4 4.8 3.8 8 3.8 11.8 C 3.8 16.4 7.5 20.1 12.1 20.1 C 15.6 20.1 18.5 17.7 19.6 14.2 Z",
    "sun": "O 12 12 4 M 12 3 L 12 4.6 M 12 19.4 L 12 21 M 3 12 L 4.6 12 M 19.4 12 L 21 12 M 5.6 5.6 L 6.8 6.8 "
    "M 17.2 17.2 L 18.4 18.4 M 5.6 18.4 L 6.8 17.2 M 17.2 6.8 L 18.4 5.6",
    "layers": "M 12 3.5 L 21 8 L 12 12.5 L 3 8 Z M 3 12.2 L 12 16.7 L 21 12.2 M 3 16.2 L 12 20.7 L 21 16.2",
    "file": "M 13.5 3.5 L 7 3.5 C 5.9 3.5 5 4.4 5 5.5 L 5 18.5 C 5 19.6 5.9 20.5 7 20.5 L 17 20.5 "
    "C 18.1 20.5 19 19.6 19 18.5 L 19 9 Z M 13.5 3.5 L 13.5 9 L 19 9 M 8.5 13 L 15.5 13 M 8.5 16.5 L 13.5 16.5",
    "download": "M 12 4 L 12 15 M 7 10.5 L 12 15.5 L 17 10.5 M 4.5 19.5 L 19.5 19.5",
    "chevron": "M 9.5 6 L 15.5 12 L 9.5 18",
    "chevron_down": "M 6 9.5 L 12 15.5 L 18 9.5",
    "chevron_left": "M 14.5 6 L 8.5 12 L 14.5 18",
    "arrow_up": "M 12 19 L 12 5.5 M 6.5 11 L 12 5.5 L 17.5 11",
    "arrow_down": "M 12 5 L 12 18.5 M 6.5 13 L 12 18.5 L 17.5 13",
    "fast_forward": "M 3.5 6.2 L 11.5 12 L 3.5 17.8 Z M 12.5 6.2 L 20.5 12 L 12.5 17.8 Z",
    "mouse": "R 6.5 3 11 18 5.5 M 12 7 L 12 10.5",
    "undo": "M 8.5 4.5 L 4 9 L 8.5 13.5 M 4 9 L 14.5 9 C 17.5 9 20 11.5 20 14.5 C 20 17.5 17.5 20 14.5 20 L 10.5 20",
    "redo": "M 15.5 4.5 L 20 9 L 15.5 13.5 M 20 9 L 9.5 9 C 6.5 9 4 11.5 4 14.5 C 4 17.5 6.5 20 9.5 20 L 13.5 20",
    "save": "M 16 3.5 L 5.5 3.5 C 4.4 3.5 3.5 4.4 3.5 5.5 L 3.5 18.5 C 3.5 19.6 4.4 20.5 5.5 20.5 L 18.5 20.5 "
    "C 19.6 20.5 20.5 19.6 20.5 18.5 L 20.5 8 Z M 7.5 20.5 L 7.5 14 L 16.5 14 L 16.5 20.5 M 7.5 3.5 L 7.5 8 L 14 8",
    "copy": "R 9 9 11.5 11.5 2 M 5.5 15 L 5 15 C 4.2 15 3.5 14.3 3.5 13.5 L 3.5 5 C 3.5 4.2 4.2 3.5 5 3.5 "
    "L 13.5 3.5 C 14.3 3.5 15 4.2 15 5 L 15 5.5",
    "route": "O 5.5 18.5 2.2 O 18.5 5.5 2.2 M 16.3 5.5 L 9.5 5.5 C 7.6 5.5 6 7.1 6 9 C 6 10.9 7.6 12 9.5 12 "
    "L 14.5 12 C 16.4 12 18 13.1 18 15 C 18 16.9 16.4 18.5 14.5 18.5 L 7.7 18.5",
    "eye": "M 2.5 12 C 2.5 12 6 5.5 12 5.5 C 18 5.5 21.5 12 21.5 12 C 21.5 12 18 18.5 12 18.5 C 6 18.5 2.5 12 2.5 12 Z "
    "O 12 12 3",
    "list": "M 9 6 L 20 6 M 9 12 L 20 12 M 9 18 L 20 18 fill O 4.5 6 1.3 fill O 4.5 12 1.3 fill O 4.5 18 1.3",
    "number": "M 9.5 4 L 7.5 20 M 16.5 4 L 14.5 20 M 4 9 L 20 9 M 4 15 L 20 15",
    "letter": "M 5.5 7.5 L 5.5 5 L 18.5 5 L 18.5 7.5 M 12 5 L 12 19.5 M 9.5 19.5 L 14.5 19.5",
    "slider": "M 3 12 L 9 12 M 15 12 L 21 12 O 12 12 3",
    "columns": "R 3.5 4.5 17 15 2 M 12 4.5 L 12 19.5",
    "scale": "M 3 15 L 21 15 M 3 10 L 3 15 M 7.5 12 L 7.5 15 M 12 10 L 12 15 M 16.5 12 L 16.5 15 M 21 10 L 21 15",
    "people": "O 9 8 3.2 M 3 19.5 C 3 15.5 5.5 13.5 9 13.5 C 12.5 13.5 15 15.5 15 19.5 "
    "M 15.5 5 C 18.5 5 18.5 11 15.5 11 M 17.5 14 C 20 14.8 21 16.8 21 19.5",
    "search": "O 10.5 10.5 6 M 15 15 L 20.5 20.5",
    "trash": "M 4 6.5 L 20 6.5 M 9 6.5 L 9 4 L 15 4 L 15 6.5 M 6 6.5 L 7 20 L 17 20 L 18 6.5 M 10 10.5 L 10 16.5 "
    "M 14 10.5 L 14 16.5",
    "designer": "R 3 4 18 6.5 2 R 3 14 8 6.5 2 M 14.5 20 L 15.2 17.4 L 19.6 13 L 21.4 14.8 L 17 19.2 L 14.5 20",
    "arrow_right": "M 5 12 L 18.5 12 M 13 6.5 L 18.5 12 L 13 17.5",
    "pulse": "M 3 12 L 7.5 12 L 10 6 L 14 18 L 16.5 12 L 21 12",
}


@cache
def _icon_paths(name: str) -> tuple[QPainterPath, QPainterPath]:
    """Return the stroked and the filled path of an icon on the grid."""
    stroked, filled = QPainterPath(), QPainterPath()
    path = stroked
    tokens = iter(PATHS[name].split())

    def numbers(count: int) -> list[float]:
        return [float(next(tokens)) for _ in range(count)]

    for word in tokens:
        match word:
            case "fill":
                path = filled
            case "M":
                path.moveTo(*numbers(2))
            case "L":
                path.lineTo(*numbers(2))
            case "Q":
                path.quadTo(*numbers(4))
            case "C":
                path.cubicTo(*numbers(6))
            case "Z":
                path.closeSubpath()
            case "O":
                x, y, r = numbers(3)
                path.addEllipse(QRectF(x - r, y - r, 2 * r, 2 * r))
            case "R":
                x, y, w, h, r = numbers(5)
                path.addRoundedRect(QRectF(x, y, w, h), r, r)
            case _:
                raise ValueError(f"icon {name!r}: unknown word {word!r}")
    return stroked, filled


def draw_icon(painter: QPainter, name: str, rect: QRectF, colour: str | QColor, stroke: float = _STROKE) -> None:
    """Paint an icon in the central square of ``rect``; ``stroke`` is its line width on the grid of 24."""
    stroked, filled = _icon_paths(name)
    side = min(rect.width(), rect.height())
    ink = QColor(colour)
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.translate(rect.center().x() - side / 2, rect.center().y() - side / 2)
    painter.scale(side / GRID, side / GRID)
    pen = QPen(ink, stroke, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap, Qt.PenJoinStyle.RoundJoin)
    painter.setPen(pen)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawPath(stroked)
    if not filled.isEmpty():
        painter.fillPath(filled, ink)
    painter.restore()


def icon_pixmap(name: str, colour: str, size: int = 20, ratio: float = 1.0, stroke: float = _STROKE) -> QPixmap:
    """Return an icon of ``size`` logical px as a pixmap for a screen of device pixel ratio ``ratio``."""
    side = round(size * ratio)
    pixmap = QPixmap(side, side)
    pixmap.setDevicePixelRatio(ratio)
    pixmap.fill(Qt.GlobalColor.transparent)
    painter = QPainter(pixmap)
    draw_icon(painter, name, QRectF(0, 0, size, size), colour, stroke)
    painter.end()
    return pixmap


def icon(name: str, colour: str, size: int = 20) -> QIcon:
    """Return an icon for buttons and menus, sharp at every scaling from 100 to 300 %."""
    scaled_icon = QIcon()
    for ratio in _RATIOS:
        scaled_icon.addPixmap(icon_pixmap(name, colour, size, ratio))
    return scaled_icon


def logo(size: int, background: str, ink: str) -> QIcon:
    """Return the window icon: a drop on a rounded square."""
    window_icon = QIcon()
    for side in (size, 2 * size, 4 * size):
        pixmap = QPixmap(QSize(side, side))
        pixmap.fill(Qt.GlobalColor.transparent)
        painter = QPainter(pixmap)
        draw_logo(painter, QRectF(0, 0, side, side), background, ink)
        painter.end()
        window_icon.addPixmap(pixmap)
    return window_icon


def draw_logo(painter: QPainter, rect: QRectF, background: str, ink: str) -> None:
    """Paint the program's logo in ``rect``."""
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(background))
    radius = rect.width() * 0.25
    painter.drawRoundedRect(rect, radius, radius)
    inset = rect.width() * 0.19
    draw_icon(painter, "drop", rect.adjusted(inset, inset, -inset, -inset), ink, stroke=2.0)
    painter.restore()
