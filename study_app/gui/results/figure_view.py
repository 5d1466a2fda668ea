"""A figure of the analysis in the colours of the theme, sharp at every size, drawn in the background."""

import queue
import re
import threading
from collections.abc import Mapping

from PySide6.QtCore import QRectF, QSize, Qt, QTimer
from PySide6.QtGui import QColor, QImage, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtSvg import QSvgRenderer
from PySide6.QtWidgets import QSizePolicy, QWidget

from study_app.gui.theme.fonts import FAMILIES
from study_app.gui.theme.theme import Theme
from study_app.gui.theme.themed import Themed
from study_app.viewmodels.results import FigureShown

LOOK_MS = 15
LETTERS = re.compile(rb"(<text.*?</text>)", re.DOTALL)
FAMILY = re.compile(rb"font-family: [^;\"]*")
SIZE = re.compile(rb'viewBox="0 0 ([0-9.]+) ([0-9.]+)"')
WHITE = b"#ffffff"
BAND_LIGHT, BAND_DARK = 0.22, 0.34


def themed_svg(svg: bytes, colours: Mapping[str, str], theme: Theme) -> bytes:
    """Return a figure with its print colours (role → ``#rrggbb``) replaced by those of ``theme``.

    White is the paper and what stands on it, but in letters, which stand on coloured bars. The levels of agreement keep
    their colours everywhere; on dark paper they get an edge. Qt takes one family of a list: the first is written.
    """
    letters = {colour.lower().encode(): _ink(theme, role).encode() for role, colour in colours.items()}
    edge = theme.ctl if theme.dark else theme.surface
    paper = {**letters, b"stroke: " + WHITE: f"stroke: {edge}".encode(), WHITE: theme.surface.encode()}
    family = b"font-family: " + FAMILIES[0].encode()
    parts = LETTERS.split(svg)  # every second one is a text
    accent = colours.get("accent", "#").lower().encode()
    parts[::2] = [_dyed(part, paper, accent) for part in parts[::2]]
    parts[1::2] = [FAMILY.sub(family, _dyed(part, letters, accent)) for part in parts[1::2]]
    return b"".join(parts)


def _ink(theme: Theme, role: str) -> str:
    """Return the colour of a role; "band" is the accent thinned until lines are seen on it."""
    if role != "band":
        return str(getattr(theme, role))
    paper, accent = QColor(theme.surface), QColor(theme.accent)
    share = BAND_DARK if theme.dark else BAND_LIGHT
    mixed = [round(share * of(accent) + (1 - share) * of(paper)) for of in (QColor.red, QColor.green, QColor.blue)]
    return QColor(*mixed).name()


def _dyed(part: bytes, by: Mapping[bytes, bytes], accent: bytes) -> bytes:
    """Replace colours; the accent as a shade, laid on with an opacity under letters, stays as deep as it is."""
    shade = b"fill: " + re.escape(accent) + rb"; (?:fill-)?opacity"
    found = re.compile(b"|".join([shade, *map(re.escape, sorted(by, key=len, reverse=True))]))
    return found.sub(lambda match: by.get(match[0], match[0]), part)


def drawn(svg: bytes, size: QSize, ratio: float) -> QImage:
    """Return an SVG as an image of ``size`` logical px for a screen of that device pixel ratio."""
    renderer = QSvgRenderer(svg)
    image = QImage(round(size.width() * ratio), round(size.height() * ratio), QImage.Format.Format_ARGB32_Premultiplied)
    image.fill(Qt.GlobalColor.transparent)
    painter = QPainter(image)
    renderer.render(painter, QRectF(image.rect()))
    painter.end()
    image.setDevicePixelRatio(ratio)
    return image


class FigureView(Themed, QWidget):
    """One figure as wide as it is given room, with its true proportions."""

    def __init__(self, figure: FigureShown, colours: Mapping[str, str]) -> None:
        super().__init__()
        self._figure, self._colours = figure, colours
        self._image = QImage()
        self._wanted: tuple[object, ...] = ()
        self._drawing: threading.Thread | None = None
        self._made: queue.SimpleQueue[tuple[tuple[object, ...], QImage]] = queue.SimpleQueue()
        self._look = QTimer(self)
        self._look.setInterval(LOOK_MS)
        self._look.timeout.connect(self._take)
        policy = QSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        policy.setHeightForWidth(True)
        self.setSizePolicy(policy)
        self.show_figure(figure, colours)

    @property
    def settled(self) -> bool:
        """Whether what is shown is what was asked for last."""
        return self._drawing is None and not self._image.isNull()

    def show_figure(self, figure: FigureShown, colours: Mapping[str, str]) -> None:
        """Draw another figure from now on; the one before stays until that one is drawn."""
        self._figure, self._colours = figure, colours
        found = SIZE.search(figure.svg)
        self._proportion = float(found[2]) / float(found[1]) if found else 0.5
        self.setAccessibleName(figure.title)
        self.setAccessibleDescription(figure.caption)
        self.updateGeometry()
        self._ask()

    def apply_theme(self, theme: Theme) -> None:
        """Draw in the colours of ``theme``."""
        super().apply_theme(theme)
        self._ask()

    def heightForWidth(self, width: int) -> int:
        return round(width * self._proportion)

    def sizeHint(self) -> QSize:
        return QSize(900, self.heightForWidth(900))

    def minimumSizeHint(self) -> QSize:
        return QSize(320, self.heightForWidth(320))

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._ask()

    def _ask(self) -> None:
        """Have it drawn as it is to be now, unless it is."""
        if self.width() < 2 or self.height() < 2 or not self.testAttribute(Qt.WidgetAttribute.WA_Resized):
            return
        size, ratio = self.size(), self.devicePixelRatioF()
        wanted = (self._figure, self.theme.name, size, ratio)
        if wanted == self._wanted:
            return
        self._wanted = wanted
        if self._drawing is None:
            self._begin()

    def _begin(self) -> None:
        wanted, figure, colours, theme = self._wanted, self._figure, self._colours, self.theme
        size, ratio = self.size(), self.devicePixelRatioF()
        made = self._made

        def draw() -> None:
            made.put((wanted, drawn(themed_svg(figure.svg, colours, theme), size, ratio)))

        self._drawing = threading.Thread(target=draw, name="figure", daemon=True)
        self._drawing.start()
        self._look.start()

    def _take(self) -> None:
        """Show what was drawn; begin again where something else is wanted by now."""
        try:
            what, self._image = self._made.get_nowait()
        except queue.Empty:
            return
        self._look.stop()
        self._drawing = None
        self.update()
        if what != self._wanted:
            self._begin()

    def paintEvent(self, _event: QPaintEvent) -> None:
        if self._image.isNull():
            self._ask()
            return
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        if self.devicePixelRatioF() != self._image.devicePixelRatioF():
            self._ask()
        painter.drawImage(QRectF(self.rect()), self._image)
