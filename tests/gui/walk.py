"""What must hold in every window: nothing is cut, everything has a name, no button is dead."""

from PySide6.QtCore import QRect, QSize, Qt
from PySide6.QtGui import QAccessible
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractScrollArea,
    QApplication,
    QComboBox,
    QLabel,
    QLineEdit,
    QPushButton,
    QScrollBar,
    QSlider,
    QWidget,
)

from study_app.gui.widgets.labels import Elided
from study_app.gui.widgets.live_plots import Plot


def settle(window: QWidget, size: QSize | tuple[int, int] | None = None) -> None:
    """Give a window a size, and let layouts within layouts come to rest."""
    if size is not None:
        window.resize(size if isinstance(size, QSize) else QSize(*size))
    for _ in range(4):
        QApplication.processEvents()


def place_of(widget: QWidget, window: QWidget) -> QRect:
    return QRect(widget.mapTo(window, widget.rect().topLeft()), widget.size())


def scrolls(widget: QWidget, window: QWidget) -> bool:
    """Whether a part of the window that may scroll holds ``widget``."""
    parent = widget.parentWidget()
    while parent is not None and parent is not window:
        if isinstance(parent, QAbstractScrollArea):
            return True
        parent = parent.parentWidget()
    return False


def cut(window: QWidget) -> list[str]:
    """Return what cannot be read whole: words without room, or beyond the window or their parent."""
    found = []
    for widget in window.findChildren(QWidget):
        if not widget.isVisible() or not isinstance(widget, QLabel | QPushButton | QLineEdit | QComboBox):
            continue
        words = widget.accessibleName() or ("" if isinstance(widget, QComboBox) else widget.text())
        place = place_of(widget, window)
        inside = window.rect().contains(place)
        across = place.left() >= 0 and place.right() <= window.width()
        if not (across if scrolls(widget, window) else inside):
            found.append(f"{words}: outside")
        parent = widget.parentWidget()
        if parent is not None and not parent.rect().adjusted(-1, -1, 1, 1).contains(widget.geometry()):
            found.append(f"{words}: beyond its parent")
        if isinstance(widget, QPushButton) and widget.text() and widget.width() < widget.minimumSizeHint().width():
            found.append(f"{words}: {widget.width()} px for {widget.minimumSizeHint().width()}")
        if (
            isinstance(widget, QLabel)
            and not isinstance(widget, Elided)
            and widget.textFormat() != Qt.TextFormat.RichText
        ):
            metrics = widget.fontMetrics()
            if widget.wordWrap() and widget.height() < widget.heightForWidth(widget.width()):
                found.append(f"{words}: too low")
            lines = map(metrics.horizontalAdvance, widget.text().split("\n"))
            if not widget.wordWrap() and widget.width() < max(lines):
                found.append(f"{words}: too narrow")
            if widget.text() and widget.height() < metrics.height():
                found.append(f"{words}: lower than a line")
    return found


def unnamed(window: QWidget) -> list[str]:
    """Return what takes the keyboard, scrolls, or shows a curve, and has no name for those who cannot see it."""
    found = [str(window)] if not QAccessible.queryAccessibleInterface(window) else []
    for part in window.findChildren(QWidget):
        if not part.isVisible() or part.focusProxy() is not None:
            continue
        told = QAccessible.queryAccessibleInterface(part)
        name = told.text(QAccessible.Text.Name)
        if (part.focusPolicy() & Qt.FocusPolicy.TabFocus or isinstance(part, QScrollBar)) and not name:
            found.append(repr(part))
        if isinstance(part, Plot):
            sentence = told.text(QAccessible.Text.Description)
            if told.role() != QAccessible.Role.Chart or not name or len(sentence.split()) <= 5 or sentence[-1] != ".":
                found.append(f"{part!r}: {sentence}")
    return found


def misnamed(window: QWidget) -> list[str]:
    """Return what is spoken otherwise than the visible label next to it says: voice control would not find it."""
    found = []
    for shown in window.findChildren(QLabel):
        part = shown.buddy()
        if part is not None and shown.isVisible() and shown.text() not in part.accessibleName():
            found.append(f"{shown.text()!r}: {part.accessibleName()!r}")
    return found


def unreached(window: QWidget) -> list[str]:
    """Return what takes the keyboard but is not in the chain of the Tab key."""
    chain, part = set(), window.nextInFocusChain()
    while part is not window:
        chain.add(part)
        part = part.nextInFocusChain()
    takes = (
        one for one in window.findChildren(QWidget) if one.isVisible() and one.focusPolicy() & Qt.FocusPolicy.TabFocus
    )
    return [repr(one) for one in takes if one not in chain]


def upright(window: QWidget) -> list[str]:
    """Return the buttons and sliders that ask for more height than width."""
    parts = [*window.findChildren(QPushButton), *window.findChildren(QSlider)]
    hints = [(part.accessibleName() or part.text(), part.sizeHint()) for part in parts if part.isVisible()]
    return [name for name, hint in hints if hint.width() < hint.height()]


def dead(window: QWidget) -> list[str]:
    """Return the buttons that do nothing, and those too small to be hit."""
    signals = ("2clicked(bool)", "2clicked()", "2pressed()")
    found = []
    for one in window.findChildren(QAbstractButton):
        words = one.text() or one.accessibleName()
        if isinstance(one, QPushButton) and not one.isCheckable() and not any(map(one.receivers, signals)):
            found.append(f"dead: {words}")
        if one.isVisible() and one.isEnabled() and min(one.width(), one.height()) < 24:
            found.append(f"small: {words}")
    return found
