"""A form: questions of several kinds on one page, or on as few as hold them, by mouse, keyboard or touch alone."""

from collections.abc import Sequence

from study_app.gui.participant.forms.fields import FIELDS
from study_app.gui.participant.forms.question_field import QuestionField, target_px
from study_app.gui.participant.forms.questions_page import QuestionsPage
from study_app.protocol.questions import ItemView

MOST_OVER = 0.2  # of the page's height that a part may be too high and still be tried with smaller words
SHRINKING = (0.94, 0.88, 0.82)  # of words that are larger than they must be, where all questions then fit

Parts = list[list[QuestionField]]


class FormWidget(QuestionsPage):
    """Questions of any kind, each as high as it needs."""

    def made_field(self, item: ItemView) -> QuestionField:
        """Return the widget that the kind of a question names."""
        return FIELDS[item.widget](item, self._words, self)

    def missing_words(self, numbers: Sequence[int]) -> str:
        """Return the sentence that names what still needs an answer."""
        return self._words.questions_missing(numbers)

    def arranged(self, asked: Sequence[QuestionField]) -> Parts:
        """Return the questions in parts that fit; with smaller words on one part where two are nearly one."""
        must = self.words_scale > 1.0 and self._text_scale > 1.0
        parts = self._packed(asked, self.words_scale)
        if len(parts) == 2 and not must:
            return self._on_one_part(asked) or self._packed(asked, self.words_scale)
        return parts

    def _on_one_part(self, asked: Sequence[QuestionField]) -> Parts | None:
        """Return the questions in one part with smaller words, where a little smaller is enough."""
        for shrink in SHRINKING:
            parts = self._packed(asked, self.words_scale * shrink)
            if len(parts) == 1:
                return parts
            if sum(field.minimumHeight() for field in parts[1]) > MOST_OVER * self.height():
                return None
        return None

    def _packed(self, asked: Sequence[QuestionField], scale: float) -> Parts:
        """Return the questions in parts as high as there is room, with words of a size."""
        margins = self.questions.contentsMargins()
        width = self.width() - margins.left() - margins.right()
        whole, divided = self.room(tabs=False), self.room(tabs=True)
        heights = [_fitted(field, scale, width, divided if len(asked) > 1 else whole) for field in asked]
        parts = _parts(asked, heights, whole)
        return parts if len(parts) == 1 else _parts(asked, heights, divided)


def _fitted(field: QuestionField, scale: float, width: int, room: int) -> int:
    """Give a question words of a size, smaller where it is too high for a part of its own; return its height [px]."""
    for percent in range(100, 45, -5):
        field.set_scale(scale * percent / 100)
        if (height := max(field.height_in(width, room), round(target_px(scale * percent / 100)))) <= room:
            break
    field.setMinimumHeight(height)
    return height


def _parts(asked: Sequence[QuestionField], heights: Sequence[int], room: int) -> Parts:
    """Return the questions in parts that are at most as high as there is room [px], as many in each as fit."""
    parts: Parts = []
    taken = 0
    for field, height in zip(asked, heights, strict=True):
        if not parts or taken + height > room:
            parts.append([])
            taken = 0
        parts[-1].append(field)
        taken += height
    return parts
