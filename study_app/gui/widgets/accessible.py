"""Names, roles and announcements for screen readers that Qt's widgets lack."""

import html

import shiboken6
from PySide6.QtCore import Qt
from PySide6.QtGui import QAccessible, QAccessibleAnnouncementEvent
from PySide6.QtWidgets import QAccessibleWidget, QLabel, QWidget

_interfaces: list[QAccessibleWidget] = []
"""Qt deletes each interface with its widget; a Python reference that ended earlier would delete it twice."""
_PRUNE_INTERVAL = 256


def give_role(widget: QWidget, role: QAccessible.Role) -> None:
    """Give ``widget`` a role that its class lacks in Qt; its accessible name and description are kept.

    Call it after all signals are connected: Qt forgets the role when a signal is connected to a Python method of the
    widget.
    """
    if len(_interfaces) % _PRUNE_INTERVAL == 0:
        _interfaces[:] = filter(shiboken6.isValid, _interfaces)
    interface = QAccessibleWidget(widget, role)
    QAccessible.registerAccessibleInterface(interface)
    _interfaces.append(interface)


def describe_plot(plot: QWidget, name: str, sentence: str) -> None:
    """Give a plot its name and description, a sentence, for screen readers."""
    plot.setAccessibleName(name)
    plot.setAccessibleDescription(sentence)
    give_role(plot, QAccessible.Role.Chart)


class PlainLabel(QLabel):
    """A label that shows its text literally: "<b>" and "&" in a study are not markup."""

    def __init__(
        self,
        text: str = "",
        parent: QWidget | None = None,
        *,
        wraps: bool = False,
        alignment: Qt.AlignmentFlag | None = None,
    ) -> None:
        super().__init__(parent)
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setWordWrap(wraps)
        if alignment is not None:
            self.setAlignment(alignment)
        self.setText(text)


def button_text(text: str) -> str:
    """Return ``text`` escaped for a button, where Qt takes a single "&" for the mark of a shortcut."""
    return text.replace("&", "&&")


def plain_tip(text: str) -> str:
    """Return ``text`` escaped for a tooltip if Qt could take it for markup."""
    return f"<qt>{html.escape(text).replace(chr(10), '<br>')}</qt>" if "<" in text else text


class HeadingLabel(PlainLabel):
    """A label that screen readers treat as a heading."""

    def __init__(self, text: str, parent: QWidget | None = None) -> None:
        super().__init__(text, parent)
        self.setAccessibleName(text)
        give_role(self, QAccessible.Role.Heading)

    def setText(self, text: str) -> None:
        super().setText(text)
        self.setAccessibleName(text)


def announce(widget: QWidget, sentence: str) -> None:
    """Announce a sentence about a widget to screen readers."""
    if QAccessible.isActive():
        QAccessible.updateAccessibility(QAccessibleAnnouncementEvent(widget, sentence))
