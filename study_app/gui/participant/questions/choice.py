"""A choice: options in a grid, one of which, or several, can be chosen."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Final

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QWidget

from study_app.gui.participant.forms.option_button import CheckOption, RadioOption
from study_app.gui.participant.forms.options_field import OptionsField
from study_app.gui.participant.pages.screen_reader import point_at
from study_app.protocol.questions import ChoiceView, ItemView, Value

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

SHORT = 12  # letters of options of which three stand side by side
MEDIUM = 28  # of which two do
MOST_ACROSS = 4


class ChoiceField(OptionsField):
    """Options in a grid; of several, a key or a click adds one or removes it."""

    widget_id: ClassVar[str] = "choice"

    def __init__(self, view: ItemView, words: Words, parent: QWidget) -> None:
        assert isinstance(view, ChoiceView)  # noqa: S101 - the registry names this widget
        self.several = view.several
        self._ids = [option for option, _ in view.options]
        self._texts = dict(view.options)
        super().__init__(view, words, parent)
        kind = CheckOption if view.several else RadioOption
        self.hold([kind(text, text, view.text, self) for _, text in view.options])
        longest = max(len(text) for _, text in view.options)
        self._across = min(len(self.options), 3 if longest <= SHORT else 2 if longest <= MEDIUM else 1)
        area = QWidget(self)
        self._cells = QGridLayout(area)
        self._cells.setContentsMargins(0, 0, 0, 0)
        self._arrange(self._across)
        self.put(area)

    @property
    def note(self) -> str:
        """The small line under the words says that several can be chosen."""
        note = super().note
        return " · ".join(filter(None, (self._words.several_possible, note))) if self.several else note

    @property
    def forward(self) -> int:
        """Which way the key → goes."""
        return -1 if self.layoutDirection() == Qt.LayoutDirection.RightToLeft else 1

    @property
    def chosen(self) -> tuple[int, ...]:
        """The places of the options that are chosen."""
        given = self.value if isinstance(self.value, tuple) else (self.value,)
        return tuple(place for place, one in enumerate(self._ids) if one in given)

    def value_at(self, place: int) -> Value:
        """Return the option."""
        return self._ids[place]

    def spoken(self) -> str:
        """Return the words of what was chosen."""
        return self._words.joined([self._texts[self._ids[place]] for place in self.chosen])

    def height_in(self, width: int, room: int) -> int:
        """Return the height [px] in a width, with more options side by side where there is too little room."""
        for across in range(self._across, min(MOST_ACROSS, len(self.options)) + 1):
            self._arrange(across)
            if (height := super().height_in(width, room)) <= room:
                return height
        return height

    def _arrange(self, across: int) -> None:
        """Put so many options side by side."""
        for number, option in enumerate(self.options):
            self._cells.addWidget(option, number // across, number % across)
        for column in range(MOST_ACROSS):
            self._cells.setColumnStretch(column, 1 if column < across else 0)

    def set_scale(self, scale: float) -> None:
        """Grow with the page."""
        super().set_scale(scale)
        self._cells.setSpacing(round(8 * scale))

    def choose(self, place: int, *, by_key: bool) -> None:
        """Answer with an option; of several, add it or remove it."""
        if not self.several:
            super().choose(place, by_key=by_key)
            return
        before = self.chosen
        if now := tuple(one for number, one in enumerate(self._ids) if (number in before) != (number == place)):
            self.give(now)
        else:
            self.take_back()
        self._check()
        point_at(self.options[place])


FIELD: Final = ChoiceField
