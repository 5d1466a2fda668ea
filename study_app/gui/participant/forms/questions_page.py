"""A page of questions, or as few parts as hold them: what forms and questionnaires of statements have in common."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QLabel, QLayout, QPushButton, QWidget

from study_app.gui.participant.forms.foot import Foot
from study_app.gui.participant.forms.question_field import MARGIN, QuestionField, question_of, target_px
from study_app.gui.participant.pages.page_widget import PageWidget, beginning
from study_app.gui.participant.pages.progress_line import ProgressLine
from study_app.gui.participant.pages.screen_reader import say
from study_app.gui.theme.theme import PARTICIPANT, font
from study_app.gui.widgets.accessible import HeadingLabel
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.protocol.questions import ItemView, shown
from study_app.session.pages import QuestionnairePage
from study_app.session.transitions.events import Chosen, ItemShown, Retracted, Submitted

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

ANSWERING = 0.8  # share of the present trial's bar that is full
TAB_WIDTH = 60.0
TAB_STYLE = (
    "QPushButton {{ background: transparent; border-radius: 8px; padding: 0; min-height: {height}px;"
    " color: {text2}; border: 1px solid {ctl}; }}"
    " QPushButton:checked {{ color: {text}; border: 2px solid {text}; }}"
)


class QuestionsPage(PageWidget):
    """Draws a page of questions and says what happens on it.

    Nothing is preset but what the page brings back after a pause. ``ItemShown`` comes once for every question, when it
    is first painted; ``Chosen`` when an answer is made or changed, ``Retracted`` where an entry was emptied;
    ``Submitted`` once, when nothing is missing. Questions that an answer shows or hides come and go at once.
    """

    def __init__(
        self,
        page: QuestionnairePage,
        words: Words,
        clock: Callable[[], float],
        parent: QWidget | None = None,
        *,
        text_scale: float = 1.0,
    ) -> None:
        super().__init__(words, clock, parent, text_scale=text_scale)
        self._page = page
        self._part = 0
        self.parts: list[list[QuestionField]] = []
        self._submitted = False
        self._unsent: list[ItemShown] = []
        self.setAccessibleName(page.title)
        self.setAccessibleDescription(page.intro)
        self._progress = ProgressLine(page.progress, words, ANSWERING, self)
        self._title, self._intro = HeadingLabel(page.title, self), QLabel(page.intro, self)
        self._intro.setWordWrap(True)
        self._intro.setVisible(bool(page.intro))
        for label, ink in ((self._title, PARTICIPANT.text), (self._intro, PARTICIPANT.text2)):
            label.setStyleSheet(f"color: {ink}; background: transparent;")
            label.setAlignment(beginning(self) | Qt.AlignmentFlag.AlignVCenter)
        self.fields = tuple(self.made_field(item) for item in page.items)
        self.foot = Foot(words, self)
        self.foot.button.clicked.connect(self.submit)
        self.tabs: list[QPushButton] = []
        self._lay_out_once()
        self._sender = QTimer(self)
        self._sender.setSingleShot(True)
        self._sender.setInterval(0)
        self._sender.timeout.connect(self._send_seen)
        chosen = dict(page.chosen)
        for field in self.fields:
            if field.view.id in chosen:
                field.show_answer(chosen[field.view.id])
            field.answered.connect(lambda value, field=field: self._answered(field, value))
            field.retracted.connect(lambda field=field: self._retracted(field))
            field.left.connect(lambda field=field: self._leave(field))
            field.seen.connect(lambda field=field: self._saw(field))

    def made_field(self, item: ItemView) -> QuestionField:
        """Return the widget of a question."""
        raise NotImplementedError

    def arranged(self, asked: Sequence[QuestionField]) -> list[list[QuestionField]]:
        """Give the questions that are asked their sizes, and return the parts that they stand on."""
        raise NotImplementedError

    def missing_words(self, numbers: Sequence[int]) -> str:
        """Return the sentence that names what still needs an answer."""
        raise NotImplementedError

    def _lay_out_once(self) -> None:
        self._tab_row = hbox()
        self._head_row = hbox((self._title, 1), self._tab_row)
        self._head = vbox(self._progress, self._head_row, self._intro)
        self.questions = vbox(*self.fields, (STRETCH, 1), spacing=0)
        for field in self.fields:
            field.hide()
        whole = vbox(self._head, (self.questions, 1), self.foot, spacing=0, margins=0, parent=self)
        whole.setSizeConstraint(QLayout.SizeConstraint.SetNoConstraint)  # the window's size is given

    @property
    def asked(self) -> tuple[QuestionField, ...]:
        """The questions that the answers so far leave shown, on whatever part."""
        answers = {field.view.id: field.value for field in self.fields if field.is_answered}
        names = shown(self._page.items, answers)
        return tuple(field for field in self.fields if field.view.id in names)

    @property
    def missing(self) -> tuple[int, ...]:
        """Numbers of the required questions without an answer."""
        return tuple(field.view.number for field in self.asked if field.view.required and not field.is_answered)

    @property
    def message(self) -> str:
        """What the foot says: which questions still need an answer, once Continue was pressed too early."""
        numbers = [field.view.number for field in self.asked if field.missing]
        return self.missing_words(numbers) if numbers else ""

    @property
    def part(self) -> tuple[QuestionField, ...]:
        """The questions of the part that is shown."""
        return tuple(self.parts[self._part]) if self.parts else ()

    @property
    def button(self) -> QPushButton:
        """The button that goes on."""
        return self.foot.button

    @property
    def tight(self) -> bool:
        """Whether margins give way, in a window that is low for its words."""
        return self.height() < 740 * self.words_scale

    @property
    def margin(self) -> float:
        """From the window's edges to the words [px]."""
        return (40 if self.width() >= 1100 else 24) * self.space_scale

    def room(self, *, tabs: bool) -> int:
        """Return the height [px] that there is for questions, with the parts' tabs or without."""
        self._head.invalidate()
        title = self._title.sizeHint().height()
        head = self._head.heightForWidth(self.width())  # -1 without an introduction, which wraps
        head = (head if head >= 0 else self._head.sizeHint().height()) - self._head_row.sizeHint().height() + title
        higher = max(0, round(target_px(self.words_scale)) - title) if tabs else 0
        return self.height() - head - higher - self.foot.height()

    def focus_first(self) -> None:
        """Put the keyboard on the first question without an answer."""
        self.go_to(self._first)

    @property
    def _first(self) -> QuestionField:
        """The first question without an answer."""
        asked = self.asked
        return next((field for field in asked if not field.is_answered), asked[0])

    def submit(self) -> None:
        """Confirm the answers, go to the next part, or name what is missing and go there."""
        for field in self.part:
            if not field.finish():
                field.setFocus(Qt.FocusReason.OtherFocusReason)
                return
        waiting = [field for field in self.part if field.view.required and not field.is_answered]
        if not waiting and self._part + 1 < len(self.parts):
            self.go_to(self.parts[self._part + 1][0])
            return
        if not waiting:
            waiting = [field for field in self.asked if field.view.required and not field.is_answered]
        if waiting:
            for field in waiting:
                field.ask(missing=True)
            self.go_to(waiting[0])
            self.button.setAccessibleDescription(self.message)
            say(self, self.message)
            self._tell()
        elif not self._submitted:
            self._submitted = True
            self._send_seen()
            self.event_made.emit(Submitted(self._clock()))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            if not event.isAutoRepeat():
                self.submit()
        elif event.key() in (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_Backspace):
            self._move(1 if event.key() == Qt.Key.Key_Down else -1)
        else:
            super().keyPressEvent(event)

    def lay_out(self, scale: float) -> None:
        """Give every part its size; decide how many questions a part holds."""
        self.space_scale = scale
        text, margin = self.words_scale, round(self.margin)
        side = round(self.margin - MARGIN * scale)
        self._head.setContentsMargins(margin, round((12 if self.tight else 20) * scale), margin, round(4 * scale))
        self._head.setSpacing(round((0 if self.tight else 6) * scale))
        self.questions.setContentsMargins(side, 0, side, 0)
        self._progress.set_scale(text)
        self._title.setFont(font("title", scale=text * (0.86 if self.tight else 1.0)))
        self._intro.setFont(font("statement", scale=text))
        self._tab_row.setSpacing(round(8 * scale))
        self.foot.set_scale(text, margin, tight=self.tight)
        self._arrange()

    def _arrange(self) -> None:
        """Divide the questions into parts that fit, and show the one that has the keyboard."""
        here = self.focusWidget()
        kept = question_of(here) if here is not None else None
        self.parts = self.arranged(self.asked)
        index = next((n for n, part in enumerate(self.parts) if kept in part), min(self._part, len(self.parts) - 1))
        self._show(index)

    def _show(self, index: int) -> None:
        self._part = index
        part = self.part
        for field in self.fields:
            field.setVisible(field in part)
            field.last = field is part[-1]
        for before, after in zip(part, (*part[1:], self.button), strict=True):
            QWidget.setTabOrder(before.focusProxy() or before, after.focusProxy() or after)
        self._tab_parts()
        self._tell()

    def _tab_parts(self) -> None:
        """Offer the parts by the numbers of their questions."""
        wanted = self.parts if len(self.parts) > 1 else []
        while len(self.tabs) > len(wanted):
            tab = self.tabs.pop()
            self._tab_row.removeWidget(tab)
            tab.hide()
            tab.deleteLater()
        while len(self.tabs) < len(wanted):
            self.tabs.append(self._new_tab(len(self.tabs)))
        text = self.words_scale
        for index, (tab, part) in enumerate(zip(self.tabs, wanted, strict=True)):
            first, last = part[0].view.number, part[-1].view.number
            tab.setText(str(first) if first == last else f"{first}–{last}")
            tab.setFont(font("label", scale=text))
            inner = round(target_px(text)) - 2  # without the edge
            theme = PARTICIPANT
            tab.setStyleSheet(TAB_STYLE.format(text=theme.text, text2=theme.text2, ctl=theme.ctl, height=inner))
            tab.setFixedSize(round(TAB_WIDTH * text), inner + 2)
            tab.setChecked(index == self._part)

    def _new_tab(self, part: int) -> QPushButton:
        tab = QPushButton(self)
        tab.setCheckable(True)
        tab.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        tab.clicked.connect(lambda: self.go_to(self.parts[part][0]))
        self._tab_row.addWidget(tab)
        return tab

    def _tell(self) -> None:
        """Bring the foot up to date."""
        asked = self.asked
        here = self.focusWidget()
        question = question_of(here) if here is not None else self._first  # where the keyboard will be
        keys = "" if question is None else question.answer_keys
        self.foot.show_state(self.message, sum(field.is_answered for field in asked), len(asked), keys)

    def go_to(self, field: QuestionField) -> None:
        """Show the part with a field and put the keyboard on it."""
        index = next((n for n, part in enumerate(self.parts) if field in part), self._part)
        if index != self._part:
            self._show(index)
        field.setFocus(Qt.FocusReason.OtherFocusReason)
        self._tell()

    def _move(self, by: int) -> None:
        """Put the keyboard on the next or the previous question; after the last comes the button."""
        here = self.focusWidget()
        question = question_of(here) if here is not None else None
        asked = self.asked
        target = (asked.index(question) if question in asked else len(asked)) + by
        if target >= len(asked):
            self.button.setFocus(Qt.FocusReason.TabFocusReason)
        elif target >= 0:
            self.go_to(asked[target])

    def _leave(self, field: QuestionField) -> None:
        """Go on from a question that a key answered, within its part; after its last comes the button."""
        part = self.part
        following = part.index(field) + 1 if field in part else len(part)
        if following < len(part):
            self.go_to(part[following])
        else:
            self.button.setFocus(Qt.FocusReason.TabFocusReason)
            self._tell()

    def _answered(self, field: QuestionField, value: object) -> None:
        self._send_seen()
        self.event_made.emit(Chosen(self._clock(), field.view.id, value))  # type: ignore[arg-type]
        self._follow_up()

    def _retracted(self, field: QuestionField) -> None:
        self._send_seen()
        self.event_made.emit(Retracted(self._clock(), field.view.id))
        self._follow_up()

    def _follow_up(self) -> None:
        """Show the questions that an answer shows, and empty those that it hides."""
        asked = self.asked
        for field in self.fields:
            if field not in asked and field.is_answered:
                field.forget()
        if asked != tuple(one for part in self.parts for one in part):
            self._arrange()
        self._tell()

    def _saw(self, field: QuestionField) -> None:
        """Keep the moment; the event is emitted after the painting."""
        self._unsent.append(ItemShown(self._clock(), field.view.id))
        self._sender.start()

    def _send_seen(self) -> None:
        seen, self._unsent = self._unsent, []
        for event in seen:
            self.event_made.emit(event)
