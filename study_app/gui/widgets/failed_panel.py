"""The cockpit's panels, each of which may fail alone: a line takes its place, and the session goes on.

What holds the session and the force (header, banner, force stop, buttons) is no panel: where it fails, so does the
session.
"""

from collections.abc import Callable, Iterator, Mapping
from traceback import clear_frames
from types import FrameType, TracebackType

from PySide6.QtCore import QEvent, QObject, QRectF, Qt, QTimer, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QGraphicsItem, QWidget

from study_app.gui.theme.theme import LIGHT, RADIUS_CARD
from study_app.gui.theme.themed import Themed, apply_theme_within
from study_app.gui.widgets.boxes import hbox
from study_app.gui.widgets.cards import SHADOW, Card, Icon, fill_rounded
from study_app.gui.widgets.labels import label

LEAST_WIDTH = 140  # of a panel that has room for the line; the sign alone has a tip that says it


class FailedPanel(Themed, QWidget):
    """Covers a panel, at any size, with one line that says that it failed."""

    def __init__(self, panel: QWidget, name: str) -> None:
        super().__init__(panel)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)  # nothing below it is painted any more
        self.line = label(f"{name}: this panel failed. The session continues.", "label", "bad", wraps=True)
        self.setToolTip(self.line.text())
        top = Qt.AlignmentFlag.AlignTop
        hbox((Icon("warning", "bad", 20), 0, top), (self.line, 1, top), margins=(14, 8, 14, 8), parent=self)
        panel.installEventFilter(self)
        self._fit(panel)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() in {QEvent.Type.Resize, QEvent.Type.ChildAdded} and isinstance(watched, QWidget):
            self._fit(watched)
        return False

    def _fit(self, panel: QWidget) -> None:
        self.resize(panel.size())
        self.line.setVisible(panel.width() >= LEAST_WIDTH)
        self.raise_()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint all of it, since nothing is painted below: in place of a card the window's ground shows at corners."""
        painter = QPainter(self)
        if not isinstance(self.parentWidget(), Card):
            painter.fillRect(self.rect(), QColor(self.theme.bad_bg))
            return
        painter.fillRect(self.rect(), QColor(self.theme.window))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        body = QRectF(self.rect()).adjusted(SHADOW, SHADOW, -SHADOW, -SHADOW)
        fill_rounded(painter, body, RADIUS_CARD, self.theme.bad_bg)


class Panels(QObject):
    """Draws panels, each with its name, and switches one off for good where it raises.

    ``failed(name, error)`` comes once for each panel.
    """

    failed = Signal(str, object)

    def __init__(self, names: Mapping[QWidget, str]) -> None:
        super().__init__()
        self.names = dict(names)
        self.covers: dict[QWidget, FailedPanel | None] = {}

    def draw(self, panel: QWidget, how: Callable[[], object]) -> None:
        """Let a panel be drawn, unless it failed before; what is no panel may raise."""
        if panel in self.covers:
            return
        try:
            how()
        except Exception as error:  # the panel guard: what fails is reported, and switched off
            if not self.take(error, panel):
                raise

    def take(self, error: BaseException, drawn: QWidget | None = None) -> bool:
        """Return whether ``error`` was raised in a panel, by default any of them; that one is switched off then."""
        panel = next(filter(None, map(self._panel_of, _widgets(error.__traceback__))), drawn)
        if panel not in self.names or not isinstance(error, Exception):
            return False
        if panel not in self.covers:
            self.covers[panel] = None
            QTimer.singleShot(0, panel, lambda: self._cover(panel))  # not while it is being painted
            self.failed.emit(self.names[panel], error)
        clear_frames(error.__traceback__)  # they may hold a painter, and Qt would paint no window any more
        return True

    def _panel_of(self, widget: QWidget) -> QWidget | None:
        return next((panel for panel in self.names if panel is widget or panel.isAncestorOf(widget)), None)

    def _cover(self, panel: QWidget) -> None:
        for child in panel.findChildren(QWidget, options=Qt.FindChildOption.FindDirectChildrenOnly):
            child.setEnabled(False)  # no keys go there
        cover = self.covers[panel] = FailedPanel(panel, self.names[panel])
        apply_theme_within(cover, getattr(panel.window(), "theme", LIGHT))
        cover.show()


def _widgets(trace: TracebackType | None) -> Iterator[QWidget]:
    """Yield the widgets whose methods an exception left, the innermost first."""
    frames = []
    while trace is not None:
        frames.append(trace.tb_frame)
        trace = trace.tb_next
    for frame in reversed(frames):
        owner = _owner(frame)
        if isinstance(owner, QGraphicsItem) and owner.scene() is not None:
            owner = next(iter(owner.scene().views()), None)
        if isinstance(owner, QWidget):
            yield owner


def _owner(frame: FrameType) -> object:
    code = frame.f_code
    if not code.co_argcount:
        return None
    local = frame.f_locals
    owner = local.get(code.co_varnames[0])
    if isinstance(local, dict):  # before Python 3.13 a copy that the frame keeps, and with it a painter at work
        local.clear()
    return owner
