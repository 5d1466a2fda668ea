"""Pages that a study writes: consent, instructions, breaks, the debrief."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QFontMetricsF, QKeyEvent
from PySide6.QtWidgets import QLabel, QPushButton, QWidget

from study_app.gui.participant.pages.language_switch import LanguageSwitch
from study_app.gui.participant.pages.progress_line import ProgressLine
from study_app.gui.participant.pages.reading_page import ReadingPage
from study_app.gui.participant.pages.screen_reader import say
from study_app.gui.theme.theme import PARTICIPANT, font
from study_app.session.pages import TextPage
from study_app.session.transitions.events import Continue, EndAsked, LanguageChosen

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

ICONS = {"consent": "pen", "instructions": "drop", "break": "clock", "debrief": "check"}
TICK_MS = 200


class DeclineButton(QPushButton):
    """The outlined button of a consent that ends the session."""

    def __init__(self, text: str, parent: QWidget) -> None:
        super().__init__(text, parent)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setAutoDefault(False)

    def set_scale(self, scale: float) -> None:
        """Grow with the page."""
        self.setFont(font("card", scale=scale, weight=500))
        metrics = QFontMetricsF(self.font())
        self.setFixedSize(round(metrics.horizontalAdvance(self.text()) + 44 * scale), round(48 * scale))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Decline with Enter, too, where the keyboard is here: it must not agree."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            if not event.isAutoRepeat():
                self.click()
        else:
            super().keyPressEvent(event)


class TextWidget(ReadingPage):
    """Consent, instructions, a break or the debrief.

    Space or Enter goes on; a consent asks for more: its button, or Enter; another button declines. A break with a least
    time counts it down in the place of its button. Before the consent another language can be chosen.
    """

    def __init__(
        self,
        page: TextPage,
        words: Words,
        clock: Callable[[], float],
        parent: QWidget | None = None,
        *,
        text_scale: float = 1.0,
    ) -> None:
        self._consent = page.kind == "consent"
        key = words.enter_key if self._consent else words.space_key
        progress = ProgressLine(page.progress, words, 0.0) if page.progress is not None else None
        column = (ICONS[page.kind], page.title, page.paragraphs, PARTICIPANT.accent)
        super().__init__(
            column, words, clock, button=(page.button, key), progress=progress, parent=parent, text_scale=text_scale
        )
        self._stays_until_s = page.stays_until_s
        self.count_label = QLabel(self)
        self.count_label.setStyleSheet(f"color: {PARTICIPANT.text2}; background: transparent;")
        self._ticker = QTimer(self)
        self._ticker.setInterval(TICK_MS)
        self._ticker.timeout.connect(self.tick)
        self._stacked = False
        self.languages: LanguageSwitch | None = None
        if page.languages:
            self.languages = LanguageSwitch(page.languages, page.language, words.choose_language, self)
            later = Qt.ConnectionType.QueuedConnection  # the page goes, and must not while its button hears a key
            self.languages.chosen.connect(self._choose_language, later)
            for language in self.languages.buttons:
                assert self.button is not None  # noqa: S101  # these pages have one
                QWidget.setTabOrder(language, self.button)  # above the text, so before its button
        self.decline = DeclineButton(words.decline, self) if self._consent else None
        if self.decline is not None:
            self.decline.clicked.connect(self._decline)
        if page.stays_until_s is not None:
            self._ticker.start()
        self.tick()

    @property
    def seconds_left(self) -> int:
        """Whole seconds until the page may be left, 0 when it may."""
        if self._stays_until_s is None:
            return 0
        return max(0, math.ceil(self._stays_until_s - self._clock()))

    @property
    def count(self) -> str:
        """The words of the count, "" when it is over."""
        return self.count_label.text()

    def tick(self) -> None:
        """Count down; when the time is over, put the button where the count was."""
        assert self.button is not None  # noqa: S101  # these pages have one
        left = self.seconds_left
        self.count_label.setText(self._words.continue_in.format(seconds=left) if left else "")
        self.count_label.adjustSize()
        self.count_label.setVisible(left > 0)
        self._place_count()
        if left:
            self.button.hide()
            return
        self._ticker.stop()
        if self.button.isHidden():
            self.button.show()
            if self.isVisible():
                self.focus_first()
                say(self.button, self.button.text())

    def focus_first(self) -> None:
        """Leave the consent's button alone: Space must not agree by itself."""
        if self._consent or self.button is None or self.button.isHidden():
            self.setFocus()
        else:
            self.button.setFocus()

    def lay_out(self, scale: float) -> None:
        """Place the count where the button will be."""
        super().lay_out(scale)
        self.count_label.setFont(font("card", scale=self.words_scale * 1.125, weight=500, tabular=True))
        self.count_label.adjustSize()
        self._place_count()

        self._place_decline()

    def _below_button(self, width: int) -> int:
        """Leave room for the button that declines, where the column is too narrow for both in one line."""
        if self.decline is None or self.button is None:
            return 0
        self.decline.set_scale(self.words_scale)
        self._stacked = self.button.width() + self._gap + self.decline.width() > width
        return self.decline.height() + self._gap // 2 if self._stacked else 0

    @property
    def _gap(self) -> int:
        return round(16 * self.words_scale)

    def _place_decline(self) -> None:
        """Put the button that declines next to the other one, or below it."""
        if self.decline is None or self.button is None:
            return
        place, size = self.button.geometry(), self.decline.size()
        if self._stacked:
            left, top = (place.right() - size.width() if self.mirrored else place.left()), place.bottom()
            self.decline.move(left, top + self._gap // 2)
        else:
            left = place.left() - self._gap - size.width() if self.mirrored else place.right() + self._gap
            self.decline.move(left, place.center().y() - size.height() // 2)

    def _decline(self) -> None:
        self.event_made.emit(EndAsked(self._clock(), "withdrawn", "no consent"))

    def _place_count(self) -> None:
        assert self.button is not None  # noqa: S101  # these pages have one
        place, size = self.button.geometry(), self.count_label.size()
        left = place.right() - size.width() - 3 if self.mirrored else place.left() + 4
        self.count_label.move(left, place.center().y() - size.height() // 2)

    def _lay_out_head(self, scale: float, margin: int, top: int) -> int:
        """Put the languages into the upper corner where lines end."""
        if self.languages is None:
            return top
        self.languages.set_scale(min(scale, self._room_for_languages(margin)))
        width, height = self.languages.width(), self.languages.height()
        self.languages.move(margin if self.mirrored else self.width() - margin - width, top - 4)
        return top + height - 8

    def _room_for_languages(self, margin: int) -> float:
        """Return the largest scale at which the languages fit in one line of the window."""
        assert self.languages is not None  # noqa: S101  # asked only where there are some
        self.languages.set_scale(1.0)
        return max(1.0, (self.width() - 2 * margin) / self.languages.width())

    def _choose_language(self, language: str) -> None:
        self.event_made.emit(LanguageChosen(self._clock(), language))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        enter = event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter)
        space = event.key() == Qt.Key.Key_Space and not self._consent
        if (enter or space) and not event.isAutoRepeat():
            self.go_on()
        else:
            super().keyPressEvent(event)

    def go_on(self) -> None:
        """Tell that the participant goes on, once the page may be left."""
        if not self.seconds_left:
            self.event_made.emit(Continue(self._clock()))
