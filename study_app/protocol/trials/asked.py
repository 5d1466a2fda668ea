"""What a design asks after its last interval: a questionnaire of one item, so that tables take it as any other.

The answer to an adjustment is the number of steps from where it started.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from study_app.protocol.forms.questionnaire import Questionnaire
from study_app.protocol.questions.choice import Choice, Option
from study_app.protocol.questions.number import Number
from study_app.protocol.questions.question import Question
from study_app.protocol.questions.rating import Rating
from study_app.protocol.texts import Localised
from study_app.protocol.trials.designs import Design
from study_app.protocol.wording.languages import words

LEAST: Final = 1e-9
"""An estimate is above 0, and no estimate is smaller."""


def asked(design: Design, languages: Sequence[str]) -> Questionnaire:
    """Return what a design asks, in the program's own words where it has none."""
    text: Localised = design.question or {
        language: words(language).design_questions[design.wording] for language in languages
    }
    return Questionnaire(intro=text, items=(_item(design, text, languages),))


def _item(design: Design, text: Localised, languages: Sequence[str]) -> Question:
    short: Localised = {language: words(language).design_short for language in languages}
    if design.item is not None:
        short = design.item.replace("_", " ").capitalize()
    about = {"id": design.name, "text": text, "short": short}
    if design.reply == "rating":
        return Rating(**about, scale=str(getattr(design, "scale", "")))
    if design.reply == "number":
        return Number(**about, least=LEAST)
    if design.reply == "setting":
        return Number(**about, whole=True, unit="steps")
    named = {answer: {one: words(one).design_answers[answer] for one in languages} for answer in design.answers}
    return Choice(**about, options=tuple(Option(id=answer, text=said) for answer, said in named.items()))
