"""Sentences: their languages side by side, in the width of the form, each shown whole."""

from typing import Final

from study_app.designer.form.languages_field import LanguagesField
from study_app.designer.form.special_editor import SpecialEditor
from study_app.designer.form.typed_fields import TypedSentence

QUESTIONS: Final = ("Statement", "Rating", "Slider", "Number", "Choice", "Text")
TASKS: Final = ("Explore", "Reach", "Follow")
DESIGNS: Final = ("Abx", "Adjusted", "Estimation", "ForcedChoice", "Oddity", "Rated", "SameDifferent", "YesNo")


class SentencesField(LanguagesField):
    """A sentence in each language."""

    one = TypedSentence


EDITOR: Final = SpecialEditor(
    (
        ("Questionnaire", "intro"),
        *((kind, "text") for kind in QUESTIONS),
        *((kind, "instruction") for kind in TASKS),
        *((kind, "question") for kind in DESIGNS),
    ),
    SentencesField,
    wide=True,
)
