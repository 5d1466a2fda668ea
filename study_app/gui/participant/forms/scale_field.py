"""Points in a row, the same way round in every language: what ratings in a form and statements in a grid share."""

from study_app.gui.participant.forms.option_button import RadioOption
from study_app.gui.participant.forms.options_field import MOST_DIGITS, OptionsField
from study_app.protocol.questions import Value


class ScaleField(OptionsField):
    """A row of points; "cannot judge" stands apart from them, where lines end."""

    labels: tuple[str, ...] = ()

    def build(self, labels: tuple[str, ...], judge_name: str | None, judge_text: str | None) -> None:
        """Make the options: the points of the scale, and where there is one the answer off it."""
        self.labels = labels
        names = [f"{point} {label}" for point, label in enumerate(labels, start=1)]
        text = self.view.text
        self.points = [RadioOption(str(n), name, text, self, look="point") for n, name in enumerate(names, start=1)]
        self.judge = None
        if judge_name is not None:
            self.judge = RadioOption(judge_text or "", judge_name, text, self, look="off scale")
        self.hold([*self.points, *([] if self.judge is None else [self.judge])])

    @property
    def digits(self) -> int:
        """How many points digits choose: the answer off the scale has none."""
        return min(MOST_DIGITS, len(self.labels))

    @property
    def answer_keys(self) -> str:
        """The digits of its points; beyond 9 the arrows reach them."""
        return f"1–{self.digits}"

    @property
    def chosen(self) -> tuple[int, ...]:
        """The place of the answer in the row."""
        if not self.is_answered:
            return ()
        return (self.value - 1 if isinstance(self.value, int) else len(self.points),)

    def value_at(self, place: int) -> Value:
        """Return the point, None off the scale."""
        return place + 1 if place < len(self.points) else None

    def spoken(self) -> str:
        """Return the point and its name."""
        return self.options[self.chosen[0]].accessibleName()
