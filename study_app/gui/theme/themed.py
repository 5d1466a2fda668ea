"""How the theme of a window reaches what the style sheet does not: parts that paint themselves, marks, selections."""

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QColor, QPalette
from PySide6.QtWidgets import QScrollArea, QScrollBar, QWidget

from study_app.gui.theme.theme import LIGHT, Theme, stylesheet


class Themed:
    """A widget that paints itself in the ``theme`` of its window; outside of one it is light."""

    @property
    def theme(self) -> Theme:
        return _theme_of(self) or LIGHT


class Coloured(Themed):
    """A widget that keeps colours between paintings: ``apply_theme`` sets those of another theme."""

    _applied: Theme | None = None

    def apply_theme(self, theme: Theme) -> None:
        raise NotImplementedError

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)  # type: ignore[misc]  # of the widget
        if event.type() == QEvent.Type.StyleChange and (given := _theme_of(self)) not in {None, self._applied}:
            self._applied = given
            self.apply_theme(self.theme)


def _theme_of(part: object) -> Theme | None:
    """Return the theme of a part's window; parents in between may be objects that PySide must not wrap."""
    while isinstance(part, QWidget):
        window = part.window()
        if (theme := getattr(window, "given_theme", None)) is not None:
            return theme
        part = window.parentWidget()
    return None


def apply_theme(window: QWidget, theme: Theme) -> None:
    """Apply ``theme`` to ``window`` and all its parts, including those that are added later."""
    window.given_theme = theme  # type: ignore[attr-defined]
    window.setPalette(_palette(theme))
    window.setStyleSheet(stylesheet(theme))
    name_scroll_bars(window)


def _palette(theme: Theme) -> QPalette:
    """Return the palette for parts that style sheets do not reach: check marks, arrows, selections."""
    made = QPalette()
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
        made.setColor(role, QColor(colour))
    return made


def give_ground(part: QWidget, role: str) -> None:
    """Let the style sheet paint a part's background according to its ``role``."""
    part.setProperty("role", role)
    part.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)


def name_scroll_bars(whole: QWidget) -> None:
    """Give a part's scroll bars an accessible name, which Qt does not."""
    for bar in whole.findChildren(QScrollBar):
        bar.setAccessibleName("Scroll bar")


def remove_widget(part: QWidget) -> None:
    """Remove a part from its window permanently.

    It is hidden first, because its former layout may be about to show it, and would then show it as a window.
    """
    part.hide()
    part.setParent(None)
    part.deleteLater()


def replace_inside(area: QScrollArea, inside: QWidget) -> None:
    """Replace the content of ``area``; the old content is deleted later, since one of its buttons may be pressed."""
    old = area.takeWidget()
    area.setWidget(inside)
    if old is not None:
        remove_widget(old)
