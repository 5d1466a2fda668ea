"""The questionnaire: all statements of a setting on one page, answered with mouse, keyboard or touch alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from PySide6.QtGui import QFontMetricsF
from PySide6.QtWidgets import QWidget

from study_app.gui.participant.forms.question_field import QuestionField
from study_app.gui.participant.forms.questions_page import QuestionsPage
from study_app.gui.participant.pages.column_labels import Heading, label_height, widest_word
from study_app.gui.participant.pages.questionnaire_grid import Asked, Grid, grid, parts
from study_app.gui.participant.pages.statement_field import StatementField
from study_app.gui.theme.theme import font
from study_app.protocol.questions import ItemView
from study_app.session.pages import QuestionnairePage

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words


class QuestionnaireWidget(QuestionsPage):
    """Statements that are rated on one scale: rows with the scale's labels over their columns."""

    fields: tuple[StatementField, ...]

    def __init__(
        self,
        page: QuestionnairePage,
        words: Words,
        clock: Callable[[], float],
        parent: QWidget | None = None,
        *,
        text_scale: float = 1.0,
    ) -> None:
        super().__init__(page, words, clock, parent, text_scale=text_scale)
        self._heading = Heading(page.labels, page.cannot_judge, self._row_shown, self)
        self.questions.insertWidget(0, self._heading)
        for field in self.fields:
            field.pointed_at.connect(self._heading.point)

    def made_field(self, item: ItemView) -> QuestionField:
        """Return the row of a statement."""
        return StatementField(item, self._page.labels, self._page.cannot_judge, self._words, self)

    def missing_words(self, numbers: Sequence[int]) -> str:
        """Return the sentence that names what still needs an answer."""
        return self._words.missing(numbers)

    @property
    def heading(self) -> tuple[str, ...]:
        """The labels over the columns that can be read now."""
        return self._heading.shown

    def arranged(self, asked: Sequence[QuestionField]) -> list[list[QuestionField]]:
        """Give the rows their sizes, with as many statements on a part as can be read and hit."""
        sizes, per_page = self._sizes()
        self._heading.set_sizes(sizes)
        for field in self.fields:
            field.set_sizes(sizes)
        return [list(asked[first : first + per_page]) for first in range(0, len(asked), per_page)]

    def _row_shown(self) -> StatementField:
        part = self.part
        return next((field for field in self.fields if field in part), self.fields[0])

    def _sizes(self) -> tuple[Grid, int]:
        """Return the sizes of the rows, and how many of them stand on a part."""
        page, many = self._page, len(self.fields)
        bare, label = QFontMetricsF(font("statement")), QFontMetricsF(font("label", weight=600))
        off = () if page.cannot_judge is None else (page.cannot_judge,)
        asked = Asked(
            statement=max(bare.horizontalAdvance(field.view.text) for field in self.fields),
            judge=widest_word(label, page.cannot_judge or ""),
            word=max(widest_word(label, text) for text in page.labels),
        )
        across = grid(self.width(), self.height(), asked, self.margin, text_scale=self._text_scale)
        text, scale, tight = across.text, across.scale, across.tight
        named, judged = 2 * across.cell_pitch / text, across.judge_width / text
        labels = max(label_height(page.labels, named), label_height(off, judged)) * text * 1.03
        self._heading.setFixedHeight(round(labels + (2 if tight else 10) * scale))
        note = self._words.please_answer
        for per_page in parts(many, self.width()):
            room = self.room(tabs=per_page < many) - self._heading.height()
            sizes = across.with_rows(room - (2 if tight else 8) * scale, per_page)
            if sizes.holds and all(field.fits(sizes, note) for field in self.fields):
                break
        return sizes, per_page
