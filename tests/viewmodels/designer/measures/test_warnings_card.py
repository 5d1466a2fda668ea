"""The card of warnings."""

from types import SimpleNamespace
from typing import Any

from study_app.viewmodels.designer.measures.number_cards import ON_AVERAGE
from study_app.viewmodels.designer.measures.session_cards import warnings_card


def test_warnings_are_sentences_and_places_of_the_file_stay_as_they_are() -> None:
    facts: Any = SimpleNamespace(warnings=('designs.pair.feedback: "always" shows the answer', "two liquids are alike"))
    card = warnings_card(facts, ())
    assert card is not None
    said = [words for _, _, words in card.sentences]
    assert said == ['designs.pair.feedback: "always" shows the answer.', "Two liquids are alike."]
    assert warnings_card(SimpleNamespace(warnings=()), ()) is None  # type: ignore[arg-type]  # facts without any


def test_a_warning_about_precision_says_what_it_is_about_and_a_failure_why_there_is_none() -> None:
    facts: Any = SimpleNamespace(warnings=())
    card = warnings_card(facts, ("methods.adaptive.trials: 80 trials give ±18 %",))
    assert card is not None
    assert card.sentences[-1] == ("neutral", "info", f"{ON_AVERAGE}.")
    card = warnings_card(facts, (), "The process ended.")
    assert card is not None
    assert [words for *_, words in card.sentences] == ["The expected precision is not known.", "The process ended."]
