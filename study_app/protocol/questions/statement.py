"""A statement that is rated on its questionnaire's scale of seven points: the only kind of format 1."""

from typing import ClassVar, Final

from study_app.protocol.forms.scale import Scale
from study_app.protocol.questions.question import Context
from study_app.protocol.questions.rating import Rated


class Statement(Rated):
    """A statement; if a questionnaire has only statements, they form a grid."""

    widget: ClassVar[str] = "rating"

    def scale_of(self, context: Context) -> Scale:
        """Return the questionnaire's scale."""
        return context.scales[context.scale or ""]


KIND: Final = Statement
