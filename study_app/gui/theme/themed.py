"""How a change of theme reaches what the style sheet does not: parts that paint themselves, marks, selections."""

from PySide6.QtGui import QColor, QPalette
from PySide6.QtWidgets import QScrollArea, QScrollBar, QWidget

from study_app.gui.theme.theme import LIGHT, Theme, stylesheet


class Themed:
    """What must know the theme beyond the style sheet: whatever paints itself or holds icons."""

    theme: Theme = LIGHT

    def apply_theme(self, theme: Theme) -> None:
        self.theme = theme
        if isinstance(self, QWidget):
            self.update()


def apply_theme(window: QWidget, theme: Theme) -> None:
    """Give ``window`` and all its parts the colours of ``theme``."""
    window.setPalette(_palette(theme))
    window.setStyleSheet(stylesheet(theme))
    apply_theme_within(window, theme)


def _palette(theme: Theme) -> QPalette:
    """Return the palette for what no style sheet reaches: marks of check boxes, arrows, selections."""
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


def apply_theme_within(whole: QWidget, theme: Theme) -> None:
    """Pass ``theme`` to a part and its parts, for what comes into a window later; name what Qt leaves without one."""
    for part in (whole, *whole.findChildren(QWidget)):
        if isinstance(part, Themed):
            part.apply_theme(theme)
        elif isinstance(part, QScrollBar):
            part.setAccessibleName("Scroll bar")


def remove_widget(part: QWidget) -> None:
    """Take a part out of its window for good.

    It is hidden first: the layout that it came into may still be about to show it, and would show it as a window.
    """
    part.hide()
    part.setParent(None)
    part.deleteLater()


def replace_inside(area: QScrollArea, inside: QWidget) -> None:
    """Show other content in ``area``; that before is deleted later, since one of its buttons may just be pressed."""
    old = area.takeWidget()
    area.setWidget(inside)
    if old is not None:
        remove_widget(old)
