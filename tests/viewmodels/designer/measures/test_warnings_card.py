"""The card of warnings."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from study_app.viewmodels.designer.measures.session_cards import warnings_card


def test_warnings_are_sentences_and_places_of_the_file_stay_as_they_are() -> None:
    facts: Any = SimpleNamespace(warnings=('designs.pair.feedback: "always" shows the answer', "two liquids are alike"))
    card = warnings_card(facts, ())
    assert card is not None
    said = [words for _, _, words in card.sentences]
    assert said == ['designs.pair.feedback: "always" shows the answer.', "Two liquids are alike."]
    assert warnings_card(SimpleNamespace(warnings=()), ()) is None  # type: ignore[arg-type]  # facts without any


@pytest.mark.parametrize(
    ("simulated", "said"),
    [
        (None, "The warning uses the expected precision for the 20 participants that the file plans."),
        (
            12,
            "The warning uses the expected precision for the 20 participants that the file plans. The number above is "
            "the share of simulated studies with 12 participants that reach the planned precision.",
        ),
    ],
)
def test_a_warning_about_precision_says_of_which_participants_it_is(simulated: int | None, said: str) -> None:
    facts: Any = SimpleNamespace(warnings=())
    card = warnings_card(facts, ("methods.adaptive.trials: 80 trials give ±18 %",), 20, simulated)
    assert card is not None
    assert card.sentences[-1] == ("neutral", "info", said)
