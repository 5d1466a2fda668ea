"""What screen readers receive beyond Qt's own roles: headings, plots, the participant's window."""

import html

import shiboken6
from PySide6.QtCore import Qt
from PySide6.QtGui import QAccessible, QAccessibleAnnouncementEvent
from PySide6.QtWidgets import QAccessibleWidget, QLabel, QWidget

_given: list[QAccessibleWidget] = []
_PRUNED_AT = 256  # and at its multiples


def give_role(widget: QWidget, role: QAccessible.Role) -> None:
    """Give ``widget`` a role that its class lacks in Qt; its accessible name and description are kept.

    Qt owns the interface and deletes it with the widget; Python's reference must outlive it, or it is deleted twice.
    Call it last: Qt forgets the role once a signal is connected to a method that the widget's class has in Python.
    """
    if len(_given) % _PRUNED_AT == 0:
        _given[:] = [part for part in _given if shiboken6.isValid(part)]
    made = QAccessibleWidget(widget, role)
    QAccessible.registerAccessibleInterface(made)
    _given.append(made)


def describe_plot(plot: QWidget, name: str, sentence: str) -> None:
    """Give a plot a name and a description of one sentence."""
    plot.setAccessibleName(name)
    plot.setAccessibleDescription(sentence)
    give_role(plot, QAccessible.Role.Chart)


class PlainLabel(QLabel):
    """A label that shows its text literally: "<b>" and "&" in a study are no markup."""

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
    """Return a text that a button shows literally; Qt uses a single "&" as the mark of a shortcut."""
    return text.replace("&", "&&")


def plain_tip(text: str) -> str:
    """Return a text that a tooltip shows literally, even if Qt would take it for markup."""
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
