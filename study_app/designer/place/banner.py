"""One line above the parts of the designer: why a study is read-only, a draft that was found, a file that changed."""

from PySide6.QtCore import QRectF, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent

from study_app.designer.place.designer_view import Banner
from study_app.gui.theme.theme import RADIUS_CARD
from study_app.gui.theme.themed import apply_theme_within, remove_widget
from study_app.gui.widgets.accessible import say
from study_app.gui.widgets.boxes import add_layout, hbox
from study_app.gui.widgets.cards import SHADOW, Card, Icon
from study_app.gui.widgets.controls import ActionButton, IconButton
from study_app.gui.widgets.labels import label


class BannerCard(Card):
    """Draws a `Banner`; ``asked`` carries the action of a button, "close" of the one that closes it.

    ``keyboard_left`` is emitted before the line is hidden while it has the keyboard.
    Where the study is read-only, it is hidden while another line is shown; any other banner needs an answer.
    """

    asked = Signal(str)
    keyboard_left = Signal()

    def __init__(self) -> None:
        super().__init__(padding=10, gap=6)
        self.words = label("", "label", wraps=True)
        self.sign = Icon("info", "accent", 20)
        self.buttons: list[ActionButton] = []
        self.close_button = IconButton("cross", "Close this line", "Close (Esc)", size=36, role="plain")
        self.close_button.clicked.connect(lambda: self.asked.emit("close"))
        self._banner: Banner | None = None
        self._other = False
        self._row = hbox(self.sign, (self.words, 1), self.close_button, spacing=10)
        add_layout(self.column, self._row)
        self.hide()

    def make_room(self, *, other: bool) -> None:
        """Hide what needs no answer while another line is shown (``other``)."""
        self._other = other
        shown = self._banner is not None and not (other and self._banner.only_offers_copy)
        if not shown and self.isAncestorOf(self.window().focusWidget()):
            self.keyboard_left.emit()  # else Qt hands the keyboard to the next part
        self.setVisible(shown)

    def close_by_key(self) -> bool:
        """Close a line that can be closed; return whether there was one."""
        closes = self.isVisible() and self._banner is not None and self._banner.closes
        if closes:
            self.asked.emit("close")
        return closes

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QColor(self.theme.accent))
        painter.setBrush(QColor(self.theme.selected))
        body = QRectF(self.rect()).adjusted(SHADOW, SHADOW - 1, -SHADOW, -SHADOW - 1).adjusted(0.5, 0.5, -0.5, -0.5)
        painter.drawRoundedRect(body, RADIUS_CARD, RADIUS_CARD)

    def show_banner(self, banner: Banner | None) -> None:
        """Show another banner; None hides it."""
        self._banner = banner
        self.make_room(other=self._other)
        self.close_button.setVisible(banner is not None and banner.closes)
        if banner is None:
            self.words.clear()
            return
        if banner.words == self.words.text():
            return
        self.words.setText(banner.words)
        say(self, banner.words)
        for button in self.buttons:
            remove_widget(button)
        self.buttons = []
        for action, words in banner.actions:
            made = ActionButton("", words, role="primary" if action == "copy" else "", height=36)
            made.clicked.connect(lambda _checked=False, action=action: self.asked.emit(action))
            apply_theme_within(made, self.theme)
            self._row.insertWidget(self._row.count() - 1, made)
            self.buttons.append(made)
        self.close_button.raise_()  # the last of the children: so Tab goes to it last
