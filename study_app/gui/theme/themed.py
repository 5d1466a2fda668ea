"""Apply a theme to a window, including the widgets that the style sheet does not reach."""

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QColor, QPalette
from PySide6.QtWidgets import QScrollArea, QScrollBar, QWidget

from study_app.gui.theme.theme import LIGHT, Theme, stylesheet


class Themed:
    """A widget that paints itself in the theme of its window, or in the light one if the window has none."""

    @property
    def theme(self) -> Theme:
        return _theme_of(self) or LIGHT


class Coloured(Themed):
    """A widget that stores colours between paint events; `apply_theme` sets them when the theme changes."""

    _applied: Theme | None = None

    def apply_theme(self, theme: Theme) -> None:
        raise NotImplementedError

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)  # type: ignore[misc]  # of the widget
        if event.type() == QEvent.Type.StyleChange and (theme := _theme_of(self)) not in {None, self._applied}:
            self._applied = theme
            self.apply_theme(self.theme)


def _theme_of(widget: object) -> Theme | None:
    """Return the theme of a widget's window, skipping parents in between, which PySide may be unable to wrap."""
    while isinstance(widget, QWidget):
        window = widget.window()
        if (theme := getattr(window, "given_theme", None)) is not None:
            return theme
        widget = window.parentWidget()
    return None


def apply_theme(window: QWidget, theme: Theme) -> None:
    """Apply ``theme`` to ``window`` and all its widgets, including those that are added later."""
    window.given_theme = theme  # type: ignore[attr-defined]
    window.setPalette(_palette(theme))
    window.setStyleSheet(stylesheet(theme))
    name_scroll_bars(window)


def _palette(theme: Theme) -> QPalette:
    """Return the palette for what style sheets do not reach: check marks, arrows, selections."""
    palette = QPalette()
    group = QPalette.ColorRole
    for role, colour in (
        (group.Window, theme.window),
        (group.WindowText, theme.text),
        (group.Base, theme.surface),
        (group.AlternateBase, theme.sunk),
        (group.Text, theme.text),
        (group.Button, theme.surface),
        (group.ButtonText, theme.text),
        (group.PlaceholderText, theme.text3),
        (group.Highlight, theme.accent),
        (group.HighlightedText, theme.on_accent),
        (group.Accent, theme.accent),
        (group.Mid, theme.ctl),
        (group.Dark, theme.ctl),
    ):
        palette.setColor(role, QColor(colour))
    return palette


def give_ground(widget: QWidget, role: str) -> None:
    """Let the style sheet paint a widget's background according to ``role``."""
    widget.setProperty("role", role)
    widget.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)


def name_scroll_bars(widget: QWidget) -> None:
    """Give the scroll bars in a widget an accessible name, which Qt does not."""
    for bar in widget.findChildren(QScrollBar):
        bar.setAccessibleName("Scroll bar")


def remove_widget(widget: QWidget) -> None:
    """Remove a widget from its window and delete it.

    It is hidden first, because a pending show by its former layout would open it as a window of its own.
    """
    widget.hide()
    widget.setParent(None)
    widget.deleteLater()


def replace_inside(area: QScrollArea, inside: QWidget) -> None:
    """Replace the content of ``area``. The old content is deleted later, because its button may be the caller."""
    old = area.takeWidget()
    area.setWidget(inside)
    if old is not None:
        remove_widget(old)
