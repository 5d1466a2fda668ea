"""The interface of a place of the main window: it fills the window, is entered and left, and has its own shortcuts."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget

from study_app.gui.theme.themed import Themed


class Place(Themed, QWidget):
    """A part that fills the main window next to the rail.

    ``message`` carries a title and a sentence that the main window is to say, until the place is left or emits
    ``message_over``; ``go_asked`` the name of another place.
    """

    message = Signal(str, str)
    message_over = Signal()
    go_asked = Signal(str)

    def enter(self) -> None:
        """Take note that the place is shown from now on: look again at what may have changed."""

    def leave(self) -> None:
        """React to the place being hidden: release at once every device that acts on the hand."""

    def wants_narrow_rail(self) -> bool:
        return False


def last_focused(part: QWidget) -> QWidget | None:
    """Return what in a part had the keyboard last, if it is shown and enabled."""
    last = part.focusWidget()
    return last if last not in {None, part} and last.isVisible() and last.isEnabled() else None
