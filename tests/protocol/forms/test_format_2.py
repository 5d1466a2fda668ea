"""Format 2: what it may leave out, what a file of format 1 may not hold, and what questions need of each other."""

import pytest

from study_app.haptics.model.estimators import Ewma, Kalman
from study_app.protocol.load import parse
from study_app.protocol.questionnaires import instrument, instruments
from study_app.protocol.questions import NumberView, ShowIf, shown
from tests.protocol.forms.mixed import MIXED
from tests.protocol.sound import SOUND


def test_what_format_2_leaves_out_has_its_default() -> None:
    study = parse(MIXED.encode(), "mixed")
    assert (study.format, study.study.version, study.study.title) == (2, "1", {"en": "mixed"})
    assert study.study.languages == ("en",)
    assert study.device.workspace_mm == (100, 60, 60)
    assert {name: one.liquid for name, one in study.conditions.items()} == {"thin": "thin", "thick": "thick"}
    block = study.blocks["stir"]
    assert (block.part, block.code_prefix, block.task) == (1, "A", "explore")
    assert study.text(block.title, "en") == "Stir"
    assert study.text(block.setting_label, "en") == "Trial"
    assert list(study.forms) == ["start", "load", "usability", "end"]


def test_names_of_trials_are_in_every_language_of_the_study() -> None:
    text = SOUND.replace("format = 1", "format = 2")
    text = "\n".join(line for line in text.splitlines() if not line.startswith("setting_label"))
    label = parse(text.encode(), "small").blocks["feel"].setting_label
    assert label == {"en": "Trial", "nl": "Proef"}


def test_file_of_format_1_means_the_same_in_format_2_but_for_an_estimator_that_it_leaves_out() -> None:
    one, two = (parse(SOUND.replace("format = 1", f"format = {n}").encode(), "small") for n in (1, 2))
    assert (one.scene.velocity, two.scene.velocity) == (Ewma(), Kalman())
    scene = one.scene.model_copy(update={"velocity": Kalman()})
    assert one.model_copy(update={"format": 2, "scene": scene}) == two


def test_every_instrument_with_texts_is_a_questionnaire_of_a_study() -> None:
    for name in instruments():
        if instrument(name)["languages"]:
            study = parse(MIXED.replace('instrument = "sus"', f'instrument = "{name}"').encode(), name)
            form = study.forms["usability"]
            assert [item.id for item in form.items] == [item["id"] for item in instrument(name)["items"]]
            assert set(form.scores) == set(instrument(name)["scores"])


@pytest.mark.parametrize("name", ["ipq", "panas", "ssq", "ueq"])
def test_instrument_without_texts_takes_those_of_the_study(name: str) -> None:
    texts = "".join(
        f"[[questionnaires.usability.items]]\nid = '{item['id']}'\ntext = 'About {item['id']}'\n"
        + (f"low = 'a {number}'\nhigh = 'b {number}'\n" if item["kind"] == "slider" else "")
        for number, item in enumerate(instrument(name)["items"])
    )
    scales = "".join(
        f"[scales.{name}_{scale}]\nlabels.en = {[f'point {n}' for n in range(table['points'])]}\n"
        for scale, table in instrument(name).get("scales", {}).items()
    )
    filled = f"instrument = '{name}'\nintro = 'How was it?'\n{texts}{scales}"
    study = parse(MIXED.replace('instrument = "sus"\n', filled).encode(), name)
    form = study.forms["usability"]
    assert [study.text(item.text, "en") for item in form.items] == [
        f"About {item['id']}" for item in instrument(name)["items"]
    ]
    assert set(form.scores) == set(instrument(name)["scores"])


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
