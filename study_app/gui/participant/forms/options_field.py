"""A question that is answered by choosing among options: what choices, ratings and statements have in common."""

from collections.abc import Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QFocusEvent, QKeyEvent, QMouseEvent
from PySide6.QtWidgets import QButtonGroup

from study_app.gui.participant.forms.option_button import OptionLook
from study_app.gui.participant.forms.question_field import QuestionField
from study_app.gui.participant.pages.screen_reader import point_at, say
from study_app.protocol.questions import Value

MOST_DIGITS = 9


class OptionsField(QuestionField):
    """Digits choose, the arrows move a pointer of the keyboard's own, Space chooses there; mouse and touch choose.

    ``pointed_at(place)`` comes with the option that mouse or keyboard point at, -1 for none.
    """

    several = False
    options: Sequence[OptionLook] = ()
    pointed = -1

    pointed_at = Signal(int)

    def hold(self, options: Sequence[OptionLook]) -> None:
        """Take the options, in the order of their digits."""
        self.options = options
        self._group = QButtonGroup(self)
        self._group.setExclusive(not self.several)
        # Not the methods themselves: Qt would forget the role of this widget (`give_role`).
        self._group.idClicked.connect(lambda place: self._click(place))  # noqa: PLW0108
        self._group.idToggled.connect(lambda place, on: self._toggle(place, on))  # noqa: PLW0108
        for place, option in enumerate(options):
            self._group.addButton(option, place)
            option.place = place
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)

    @property
    def digits(self) -> int:
        """How many options digits choose."""
        return min(MOST_DIGITS, len(self.options))

    @property
    def forward(self) -> int:
        """Which way the key → goes: 1 to the next option, -1 to the one before."""
        return 1

    @property
    def chosen(self) -> tuple[int, ...]:
        """The places of the options that are chosen."""
        raise NotImplementedError

    def value_at(self, place: int) -> Value:
        """Return the answer that an option alone is."""
        raise NotImplementedError

    def show_answer(self, value: Value) -> None:
        self.kept(value)
        self._check()

    def clear(self) -> None:
        """Show no option as chosen."""
        self._group.setExclusive(False)
        self._check()
        self._group.setExclusive(not self.several)

    def set_scale(self, scale: float) -> None:
        """Grow with the page."""
        super().set_scale(scale)
        for option in self.options:
            option.set_scale(scale)

    def point(self, place: int) -> None:
        """Point at an option, at none with -1."""
        if place == self.pointed:
            return
        self.pointed = place
        for number, option in enumerate(self.options):
            option.point(number == place)
        self.pointed_at.emit(place)

    def choose(self, place: int, *, by_key: bool) -> None:
        """Answer with an option; a key that answers leads to the next question."""
        self.give(self.value_at(place))
        self._check()
        point_at(self.options[place])
        if by_key:
            self.left.emit()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Choose with digits and Space, point with left and right; the rest is the page's."""
        number = event.key() - Qt.Key.Key_0
        plain = not event.modifiers() & Qt.KeyboardModifier.ControlModifier
        if 1 <= number <= self.digits and plain:
            if not event.isAutoRepeat():
                self.choose(number - 1, by_key=True)
        elif event.key() in (Qt.Key.Key_Left, Qt.Key.Key_Right):
            self._step(self.forward if event.key() == Qt.Key.Key_Right else -self.forward)
        elif event.key() == Qt.Key.Key_Space:
            if self.pointed >= 0 and not event.isAutoRepeat():
                self.choose(self.pointed, by_key=True)
        else:
            super().keyPressEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        self.point(-1)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self.setFocus(Qt.FocusReason.MouseFocusReason)
        event.accept()

    def _check(self) -> None:
        self._group.blockSignals(True)
        for place, option in enumerate(self.options):
            option.setChecked(place in self.chosen)
        self._group.blockSignals(False)

    def _click(self, place: int) -> None:
        self.setFocus(Qt.FocusReason.MouseFocusReason)
        if not self.several:
            self.choose(place, by_key=False)

    def _toggle(self, place: int, on: bool) -> None:
        """Hear what is checked, by a click or by a screen reader, which does it without one."""
        if on != (place in self.chosen) and (on or self.several):
            self.choose(place, by_key=False)

    def _step(self, by: int) -> None:
        start = self.pointed
        if start < 0:
            start = self.chosen[0] if self.chosen else (-1 if by > 0 else len(self.options))
        self.point(min(max(start + by, 0), len(self.options) - 1))
        say(self.options[self.pointed], self.options[self.pointed].accessibleName())
