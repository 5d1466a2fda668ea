"""Checks of every window: nothing is cut off, everything has a name, every button works."""

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
    """Resize a window, and wait until its nested layouts have settled."""
    if size is not None:
        window.resize(size if isinstance(size, QSize) else QSize(*size))
    for _ in range(4):
        QApplication.processEvents()


def place_of(widget: QWidget, window: QWidget) -> QRect:
    return QRect(widget.mapTo(window, widget.rect().topLeft()), widget.size())


def scrolls(widget: QWidget, window: QWidget) -> bool:
    """Return whether a scrollable part of the window contains ``widget``."""
    parent = widget.parentWidget()
    while parent is not None and parent is not window:
        if isinstance(parent, QAbstractScrollArea):
            return True
        parent = parent.parentWidget()
    return False


def cut(window: QWidget) -> list[str]:
    """Return the texts that are cut off, or beyond the window or their parent."""
    problems = []
    for widget in window.findChildren(QWidget):
        if not widget.isVisible() or not isinstance(widget, QLabel | QPushButton | QLineEdit | QComboBox):
            continue
        words = widget.accessibleName() or ("" if isinstance(widget, QComboBox) else widget.text())
        place = place_of(widget, window)
        inside = window.rect().contains(place)
        across = place.left() >= 0 and place.right() <= window.width()
        if not (across if scrolls(widget, window) else inside):
            problems.append(f"{words}: outside")
        parent = widget.parentWidget()
        if parent is not None and not parent.rect().adjusted(-1, -1, 1, 1).contains(widget.geometry()):
            problems.append(f"{words}: beyond its parent")
        if isinstance(widget, QPushButton) and widget.text() and widget.width() < widget.minimumSizeHint().width():
            problems.append(f"{words}: {widget.width()} px for {widget.minimumSizeHint().width()}")
        if (
            isinstance(widget, QLabel)
            and not isinstance(widget, Elided)
            and widget.textFormat() != Qt.TextFormat.RichText
        ):
            metrics = widget.fontMetrics()
            if widget.wordWrap() and widget.height() < widget.heightForWidth(widget.width()):
                problems.append(f"{words}: too low")
            lines = map(metrics.horizontalAdvance, widget.text().split("\n"))
            if not widget.wordWrap() and widget.width() < max(lines):
                problems.append(f"{words}: too narrow")
            if widget.text() and widget.height() < metrics.height():
                problems.append(f"{words}: lower than a line")
    return problems


def unnamed(window: QWidget) -> list[str]:
    """Return widgets that take the keyboard, scroll or show a curve but have no accessible name."""
    problems = [str(window)] if not QAccessible.queryAccessibleInterface(window) else []
    for part in window.findChildren(QWidget):
        if not part.isVisible() or part.focusProxy() is not None:
            continue
        interface = QAccessible.queryAccessibleInterface(part)
        name = interface.text(QAccessible.Text.Name)
        if (part.focusPolicy() & Qt.FocusPolicy.TabFocus or isinstance(part, QScrollBar)) and not name:
            problems.append(repr(part))
        if isinstance(part, Plot):
            sentence = interface.text(QAccessible.Text.Description)
            if (
                interface.role() != QAccessible.Role.Chart
                or not name
                or len(sentence.split()) <= 5
                or sentence[-1] != "."
            ):
                problems.append(f"{part!r}: {sentence}")
    return problems


def misnamed(window: QWidget) -> list[str]:
    """Return widgets whose accessible name lacks their visible label: voice control would not find them."""
    problems = []
    for visible_label in window.findChildren(QLabel):
        part = visible_label.buddy()
        if part is not None and visible_label.isVisible() and visible_label.text() not in part.accessibleName():
            problems.append(f"{visible_label.text()!r}: {part.accessibleName()!r}")
    return problems


def unreached(window: QWidget) -> list[str]:
    """Return widgets that take the keyboard but cannot be reached with Tab."""
    chain, part = set(), window.nextInFocusChain()
    while part is not window:
        chain.add(part)
        part = part.nextInFocusChain()
    takes = (
        widget
        for widget in window.findChildren(QWidget)
        if widget.isVisible() and widget.focusPolicy() & Qt.FocusPolicy.TabFocus
    )
    return [repr(widget) for widget in takes if widget not in chain]


def upright(window: QWidget) -> list[str]:
    """Return the buttons and sliders that ask for more height than width."""
    parts = [*window.findChildren(QPushButton), *window.findChildren(QSlider)]
    hints = [(part.accessibleName() or part.text(), part.sizeHint()) for part in parts if part.isVisible()]
    return [name for name, hint in hints if hint.width() < hint.height()]


def dead(window: QWidget) -> list[str]:
    """Return the buttons that do nothing or are smaller than 24 pixels."""
    signals = ("2clicked(bool)", "2clicked()", "2pressed()")
    problems = []
    for button in window.findChildren(QAbstractButton):
        words = button.text() or button.accessibleName()
        if isinstance(button, QPushButton) and not button.isCheckable() and not any(map(button.receivers, signals)):
            problems.append(f"dead: {words}")
        if button.isVisible() and button.isEnabled() and min(button.width(), button.height()) < 24:
            problems.append(f"small: {words}")
    return problems
