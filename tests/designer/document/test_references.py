"""References in a study file: which element a text names, which names it may have, and who refers to an element."""

import pytest

from study_app.designer.document.fields import choices_at, referenced_element, references_to
from study_app.protocol.source.document import frozen

DOCUMENT = frozen(
    {
        "liquids": {"water": {}, "oil": {}},
        "conditions": {"thin": {"liquid": "water"}, "thick": {"liquid": "oil"}, "lost": {"liquid": "honey"}},
        "tasks": {"stir": {"kind": "explore"}},
        "stimuli": {"thicker": {"condition": "thick", "vary": "viscosity_pa_s"}},
        "blocks": {
            "first": {"conditions": ["thin", "thick"], "standard": "thin", "task": "stir", "questionnaire": "after"}
        },
        "questionnaires": {
            "after": {"items": [{"id": "easy"}, {"id": "sure"}], "scores": {"sum": {"items": ["sure"]}}},
            "end": {"items": [{"id": "age"}, {"id": "easy"}], "scores": {"other": {"items": ["easy", "sure"]}}},
        },
        "analysis": {"contrasts": [{"measure": "age", "blocks": ["first", "gone"]}]},
    }
)


@pytest.mark.parametrize(
    ("place", "named"),
    [
        (("conditions", "thin", "liquid"), ("liquids", "water")),
        (("conditions", "lost", "liquid"), None),
        (("stimuli", "thicker", "condition"), ("conditions", "thick")),
        (("stimuli", "thicker", "vary"), None),
        (("blocks", "first", "conditions", 1), ("conditions", "thick")),
        (("blocks", "first", "conditions"), None),
        (("blocks", "first", "task"), ("tasks", "stir")),
        (("blocks", "first", "questionnaire"), ("questionnaires", "after")),
        (("analysis", "contrasts", 0, "blocks", 0), ("blocks", "first")),
        (("analysis", "contrasts", 0, "blocks", 1), None),
        (("questionnaires", "after", "scores", "sum", "items", 0), ("questionnaires", "after", "items", 1)),
        (("questionnaires", "end", "scores", "other", "items", 0), ("questionnaires", "end", "items", 1)),
        (("questionnaires", "end", "scores", "other", "items", 1), None),
        (("questionnaires", "after", "items", 0, "id"), None),
    ],
)
def test_a_text_names_an_element(place: tuple[str | int, ...], named: tuple[str | int, ...] | None) -> None:
    assert referenced_element(DOCUMENT, place) == named


def test_an_element_is_referred_to_by_each_text_that_names_it() -> None:
    assert set(references_to(DOCUMENT, ("conditions", "thick"))) == {
        ("stimuli", "thicker", "condition"),
        ("blocks", "first", "conditions", 1),
    }
    assert set(references_to(DOCUMENT, ("conditions", "thin"))) == {
        ("blocks", "first", "conditions", 0),
        ("blocks", "first", "standard"),
    }
    assert references_to(DOCUMENT, ("liquids", "honey")) == ()


def test_the_permitted_names_equal_those_of_the_elements() -> None:
    assert choices_at(DOCUMENT, ("conditions", "lost", "liquid")) == ("water", "oil")
    assert choices_at(DOCUMENT, ("blocks", "first", "standard")) == ("thin", "thick")
    assert choices_at(DOCUMENT, ("questionnaires", "end", "scores", "other", "items", 0)) == ("age", "easy")
    assert choices_at(DOCUMENT, ("stimuli", "thicker", "vary")) is None
