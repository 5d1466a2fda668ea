"""What every kind of question holds to: its answers, its simulated answers, its page, its column, as text and back."""

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.protocol.load import parse
from study_app.protocol.questions import KINDS, Context, Question, question_of
from tests.protocol.sound import SOUND

CONTEXT = Context(parse(SOUND.encode(), "small").scales, "agreement", "nl")
OPTIONS = [{"id": name, "text": {"en": name, "nl": f"nl {name}"}} for name in ("left", "right", "both")]

# kind, keys, answers, what is none
SAMPLES: tuple[tuple[str, dict[str, Any], tuple[Any, ...], tuple[Any, ...]], ...] = (
    ("statement", {}, (1, 7), (0, 8, None, "3", 2.5)),
    ("rating", {"scale": "agreement"}, (1, 7), (0, 8, None, "3", 2.5)),
    ("slider", {"low": "l", "high": "h", "step": 5}, (0, 5, 100), (3, -5, 105, "5", None)),
    ("number", {"from": 16, "to": 99, "whole": True, "unit": "y"}, (16, 99), (15, 100, 20.5, "20", None)),
    ("number", {}, (-2.5, 0, 1e12), (2e12, "20", None)),
    ("choice", {"options": OPTIONS}, ("left", "both"), ("foot", ("left",), None, 1)),
    (
        "choice",
        {"options": OPTIONS, "several": True},
        (("left",), ("right", "both")),
        ((), ("left", "left"), "foot", 1),
    ),
    ("text", {}, ("a word", "äö\n"), (1, None, ("a",))),
)


def question(kind: str, keys: dict[str, Any]) -> Question:
    texts = {"text": {"en": "How?", "nl": "Hoe?"}, "short": "How"}
    return question_of({"id": "asked", **texts, **({} if kind == "statement" else {"kind": kind}), **keys})


def test_every_kind_has_a_sample() -> None:
    assert {kind for kind, *_ in SAMPLES} == set(KINDS)


@pytest.mark.parametrize(("kind", "keys", "answers", "none"), SAMPLES)
def test_a_kind_takes_its_answers_and_refuses_others_in_a_sentence(
    kind: str, keys: dict[str, Any], answers: tuple[Any, ...], none: tuple[Any, ...]
) -> None:
    asked_question = question(kind, keys)
    assert (asked_question.kind_id, type(asked_question)) == (kind, KINDS[kind])
    assert [asked_question.problem(answer, CONTEXT) for answer in answers] == [None] * len(answers)
    assert all(asked_question.problem(answer, CONTEXT) for answer in none)
    assert question_of(asked_question.model_dump(mode="json", by_alias=True)) == asked_question


@pytest.mark.parametrize(("kind", "keys"), [sample[:2] for sample in SAMPLES])
@settings(max_examples=25)
@given(opinion=st.floats(-1, 10), share=st.floats(0, 1, exclude_max=True))
def test_a_simulated_answer_and_one_near_it_are_answers(
    kind: str, keys: dict[str, Any], opinion: float, share: float
) -> None:
    asked_question = question(kind, keys)
    view = asked_question.view(3, CONTEXT)
    answer = view.simulated(opinion, lambda: share)
    assert asked_question.problem(answer, CONTEXT) is None
    assert asked_question.problem(view.nearby(answer), CONTEXT) is None
    levels, bounds = asked_question.levels(CONTEXT), asked_question.bounds(CONTEXT)
    if isinstance(answer, str | tuple) and levels:
        assert {*([answer] if isinstance(answer, str) else answer)} <= set(levels)
    if bounds is not None and isinstance(answer, int | float):
        assert bounds[0] <= answer <= bounds[1]


@pytest.mark.parametrize(("kind", "keys"), [sample[:2] for sample in SAMPLES])
def test_a_page_shows_the_question_in_the_language_with_its_keys(kind: str, keys: dict[str, Any]) -> None:
    asked_question = question(kind, keys)
    view = asked_question.view(3, CONTEXT)
    assert (view.id, view.number, view.text, view.required, view.widget) == (
        "asked",
        3,
        "Hoe?",
        True,
        asked_question.widget,
    )
    assert view.keys
    assert asked_question.names_several == keys.get("several", False)
    if kind == "choice":
        assert asked_question.levels(CONTEXT) == {name: f"nl {name}" for name in ("left", "right", "both")}
