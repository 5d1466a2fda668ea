from study_app.protocol.forms.show_if import ShowIf, shown
from study_app.protocol.questions.number import NumberView


def view(name: str, condition: ShowIf | None = None) -> NumberView:
    return NumberView(name, 1, "?", True, show_if=condition)


def test_question_is_shown_by_the_answer_to_an_earlier_one() -> None:
    items = [view("a"), view("b", ShowIf(item="a", values=("x", "y"))), view("c", ShowIf(item="a", at_least=3))]
    assert shown(items, {}) == ("a",)
    assert shown(items, {"a": "y"}) == ("a", "b")
    assert shown(items, {"a": 3}) == ("a", "c")
    assert shown(items, {"a": ("z", "x")}) == ("a", "b")
    assert shown(items, {"a": None}) == ("a",)


def test_answer_to_a_hidden_question_shows_nothing() -> None:
    items = [view("a"), view("b", ShowIf(item="a", at_most=1)), view("c", ShowIf(item="b", values=5))]
    assert shown(items, {"a": 2, "b": 5}) == ("a",)
    assert shown(items, {"a": 1, "b": 5}) == ("a", "b", "c")
