"""A text that is typed."""

import unicodedata
from dataclasses import dataclass, field
from typing import ClassVar, Final, Literal

from pydantic import Field

from study_app.protocol.forms.show_if import Value
from study_app.protocol.questions.question import Context, Draw, ItemView, Question, ValueType
from study_app.protocol.texts import UNPRINTABLE

SIMULATED: Final = "Simulated answer."


@dataclass(frozen=True, slots=True)
class TextView(ItemView):
    """A field for a text as shown: ``lines`` high, for at most ``longest`` characters."""

    widget: ClassVar[str] = "text"

    lines: int = field(default=1, kw_only=True)
    longest: int = field(default=500, kw_only=True)

    @property
    def keys(self) -> str:
        """The letters."""
        return "A–Z"

    def simulated(self, opinion: float, draw: Draw) -> Value:
        """Return a sentence that says what it is."""
        return SIMULATED[: self.longest]


class Text(Question):
    """A free text."""

    widget: ClassVar[str] = "text"
    measure: ClassVar[str] = "texts"
    value_type: ClassVar[ValueType] = "text"

    kind: Literal["text"] = "text"
    lines: int = Field(default=1, ge=1, le=10, description="Height of the field, in lines.")
    longest: int = Field(default=500, ge=1, le=5000, description="Largest number of characters.")

    def view(self, number: int, context: Context) -> ItemView:
        """Return the field."""
        return TextView(*self._shown(number, context), show_if=self.show_if, lines=self.lines, longest=self.longest)

    def problem(self, answer: Value, context: Context) -> str | None:
        """Return why something is not a text that can be kept."""
        if not isinstance(answer, str) or not answer.strip():
            return "the text is empty: write one, or leave the question open"
        if len(answer) > self.longest:
            return f"the text has {len(answer)} characters: write at most {self.longest}"
        if any(unicodedata.category(letter) in UNPRINTABLE and letter != "\n" for letter in answer):
            return "the text holds a character that cannot be printed: take it out"
        return None


KIND: Final = Text
