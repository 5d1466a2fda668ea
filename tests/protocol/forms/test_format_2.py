"""Format 2: what it may leave out, what a file of format 1 may not hold, and what questions need of each other."""

from pathlib import Path

import pytest

from study_app.errors import ProtocolError
from study_app.haptics.model.scene import Ewma, Kalman
from study_app.protocol.forms.show_if import ShowIf, shown
from study_app.protocol.instruments.instrument import instrument, instruments
from study_app.protocol.load import load, parse
from study_app.protocol.orders.block_orders import orders_of
from study_app.protocol.questions.number import NumberView
from tests.protocol.faulty_protocols import SOUND
from tests.protocol.forms.mixed import MIXED, mixed_file


def problems(text: str) -> list[str]:
    with pytest.raises(ProtocolError) as raised:
        parse(text.encode(), "study.toml")
    return [str(problem) for problem in raised.value.problems]


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


def test_blocks_in_the_order_of_the_file_are_the_sequence_where_none_is_given() -> None:
    text = MIXED.replace('sequence = ["start", "stir", "load", "usability", "end"]\n', "")
    assert parse(text.encode(), "mixed").sequence == ("stir",)


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


@pytest.mark.parametrize("kind", ["ewma", "line", "kalman"])
def test_an_estimator_that_the_file_names_counts_in_both_formats(kind: str) -> None:
    named = f'[scene.velocity]\nkind = "{kind}"\n\n[liquids.'
    for n in (1, 2):
        text = SOUND.replace("format = 1", f"format = {n}").replace("[liquids.", named, 1)
        assert parse(text.encode(), "small").scene.velocity.kind == kind


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('id = "warm"\n', 'id = "warm"\nkind = "text"\n', "questionnaires.short.items.1.kind: belongs to format 2"),
        ('id = "warm"\n', 'id = "warm"\nshow_if = 1\n', "questionnaires.short.items.1.show_if: belongs to format 2"),
        ('scale = "agreement"\n', 'scale = "agreement"\ninstrument = "sus"\n', "short.instrument: belongs to format 2"),
        ('scale = "agreement"\n', "", "questionnaires.short.scale: is missing"),
        ('["hello", ', '["hello", "short", ', "sequence.2: a questionnaire on its own belongs to format 2"),
        ('"f", "g"]', '"f"]', "scales.agreement.labels.en: has 6 entries, needs at least 7 (other scales belong to"),
    ],
)
def test_what_belongs_to_format_2_is_a_fault_in_format_1(old: str, new: str, sentence: str) -> None:
    assert old in SOUND
    found = problems(SOUND.replace(old, new, 1))
    assert len(found) == 1, found
    assert sentence in found[0]
    assert "line" in found[0]


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('item = "hand", is = "both"', 'item = "used", is = "mouse"', 'show_if: "used" comes later'),
        ('is = "both"', 'is = "maybe"', 'show_if: "maybe" is not one of its answers (these are: left, right, both)'),
        ('is = "both"', "at_least = 3", 'show_if: the answer to "hand" is not a number'),
        (', is = "both"', "", "needs either is, or at_least or at_most or both"),
        ('item = "hand"', 'item = "hnad"', 'there is no item "hnad" in this questionnaire (did you mean "hand"?)'),
        ('intro = "Please', 'item_order = "shuffled"\nintro = "Please', "show_if: item_order is shuffled"),
        ('labels.en = ["Not at all", "Slightly", "Somewhat", "Rather", "Very"]', 'labels.en = ["Very"]', "at least 2"),
        ('options = [{ id = "mouse", text = "A mouse" }, ', "options = [", "has 1 entries, needs at least 2"),
        ('id = "falcon"', 'id = "mouse"', 'option "mouse" is listed twice'),
        ("to = 99", "to = 9", "9 is less than from = 16"),
        ("step = 5", "step = 7", "is 7: 14.2857 steps from end to end"),
        ("step = 5", "to = 0", "0 is not more than from = 0"),
        ('kind = "slider"', 'kind = "slidr"', '.kind: "slidr" is not a kind of question (did you mean "slider"?)'),
        ('id = "comment"', 'id = "My comment"', 'questionnaires.end.items.1.id: "My comment" is not permitted'),
        ('text = "Anything else?"', "text = 1", "questionnaires.end.items.1.text: "),
        ('scale = "agreement"', 'scale = "five"', "has 5 points, and statements need 7"),
        ('scale = "agreement"\n', "", "questionnaires.after.scale: is missing (statements are rated on it"),
        ('scale = "five"', 'scale = "fife"', 'there is no scale "fife" (did you mean "five"?)'),
        ('instrument = "sus"', 'instrument = "suss"', 'there is no instrument "suss" (did you mean "sus"?)'),
        ('instrument = "sus"', 'instrument = "panas"', 'the texts of "panas" may not be shipped: 20 items need a text'),
        ('"start", "stir"', '"start", "start", "stir"', 'form "start" comes twice'),
        ("[questionnaires.end]", "[pages.end]\nkind = 'debrief'\ntitle = 'x'\nbody = 'y'\n[questionnaires.end]",
         "a page has this name too"),
    ],
)  # fmt: skip
def test_questions_that_do_not_fit_are_named_with_their_line(old: str, new: str, sentence: str) -> None:
    assert old in MIXED
    found = problems(MIXED.replace(old, new, 1))
    assert any(sentence in one for one in found), found
    assert all("line" in one for one in found)


def test_languages_without_texts_of_an_instrument_are_a_fault(tmp_path: Path) -> None:
    found = problems(MIXED.replace('name = "mixed"', 'name = "mixed"\nlanguages = ["nl"]'))
    assert any('the texts of "nasa-tlx" exist in en: 6 items need a text' in one for one in found)


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


def test_mixed_study_is_loaded_from_its_file(tmp_path: Path) -> None:
    assert orders_of(load(mixed_file(tmp_path))).answers == 4 + 2 * 3 + 6 + 10 + 1


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
