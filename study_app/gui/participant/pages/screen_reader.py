"""Announcements to a screen reader, beyond the names and states that it asks for."""

from PySide6.QtGui import QAccessible, QAccessibleAnnouncementEvent, QAccessibleEvent
from PySide6.QtWidgets import QWidget


def point_at(widget: QWidget) -> None:
    """Lead a screen reader to ``widget``, which does not have the keyboard: it says its name and whether checked."""
    if QAccessible.isActive():
        QAccessible.updateAccessibility(QAccessibleEvent(widget, QAccessible.Event.Focus))


def say(widget: QWidget, words: str) -> None:
    """Have ``words`` said of a widget, where anybody listens."""
    if QAccessible.isActive():
        QAccessible.updateAccessibility(QAccessibleAnnouncementEvent(widget, words))
