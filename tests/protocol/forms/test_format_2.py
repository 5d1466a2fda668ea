"""What a study may omit, and what questions need of each other."""

from typing import Any

import pytest

from study_app.protocol.load import parse
from study_app.protocol.questionnaires import Instrument, Questionnaire, with_instruments
from study_app.protocol.questions import Context, NumberView, Scale, ShowIf, shown_questions
from study_app.protocol.source.document import frozen
from study_app.protocol.source.problems import Fault
from tests.protocol.forms.mixed import MIXED
from tests.protocol.sound import SOUND


def test_an_omitted_key_has_its_default() -> None:
    study = parse(MIXED.encode(), "mixed")
    assert (study.format, study.study.version, study.study.title) == (2, "1", {"en": "mixed"})
    assert study.study.languages == ("en",)
    assert study.device.workspace_mm == (100, 60, 60)
    assert {name: condition.liquid for name, condition in study.conditions.items()} == {
        "thin": "thin",
        "thick": "thick",
    }
    block = study.blocks["stir"]
    assert (block.part, block.code_prefix, block.task) == (1, "A", "explore")
    assert study.text(block.title, "en") == "Stir"
    assert study.text(block.setting_label, "en") == "Trial"
    assert list(study.forms) == ["start", "load", "usability", "end"]


def test_names_of_trials_are_in_every_language_of_the_study() -> None:
    text = "\n".join(line for line in SOUND.splitlines() if not line.startswith("setting_label"))
    label = parse(text.encode(), "small").blocks["feel"].setting_label
    assert label == {"en": "Trial", "nl": "Ronde"}


def bare(standard: Instrument, languages: tuple[str, ...]) -> tuple[dict[str, Any], dict[str, Any]]:
    items = [
        {
            "id": item["id"],
            **({"options": [{"id": option["id"]} for option in item["options"]]} if "options" in item else {}),
        }
        for item in standard.table["items"]
    ]
    return {"instrument": standard.name, "items": items}, {}


@pytest.mark.parametrize("begin", [bare, Instrument.tables_in])
@pytest.mark.parametrize("other", ["en", "nl", "de", "fr", "ar"])
@pytest.mark.parametrize("name", Instrument.names())
def test_a_study_inherits_the_texts_of_an_instrument_and_must_add_the_missing_ones(
    name: str, other: str, begin: Any
) -> None:
    languages, source = tuple(dict.fromkeys(("en", other))), Instrument(name).table
    lacking = [language for language in languages if language not in source["languages"]]

    def filled(table: dict[str, Any], scales: dict[str, Any]) -> tuple[Any, list[Fault]]:
        head = {"languages": languages}
        return with_instruments({"study": head, "questionnaires": {"form": table}, "scales": scales})

    _, faults = filled({"instrument": name}, {})
    assert [fault.missing_language for fault in faults] == lacking
    for fault in faults:
        assert all(item["id"] in fault.message for item in source["items"])
        included = f"the program does not include {name} in"
        assert fault.message.startswith(
            included if source["languages"] else f"the licence of {name} does not permit its texts to be included"
        )

    table, scales = begin(Instrument(name), languages)
    for _ in range(3):
        tables, faults = filled(frozen(table), frozen(scales))
        for fault in faults:
            words = [fault.missing_language] if fault.missing_language else lacking
            if fault.path[-1] != "instrument":
                place: Any = table
                for step in fault.path[2:-1]:
                    place = place[step]
                place.setdefault(fault.path[-1], {}).update((word, f"own {word}") for word in words)
                continue
            table["intro"] = {**table.get("intro", {}), **dict.fromkeys(words, "own")}
            for scale, scale_source in source.get("scales", {}).items():
                labels = scales.setdefault(Instrument(name).scale_name(scale), {"labels": {}})["labels"]
                labels.update(
                    (language, [f"{language} {n}" for n in range(scale_source["points"])]) for language in words
                )
        for scale in scales.values():
            known = next(iter(scale["labels"].values()))
            scale["labels"].update((language, known) for language in languages if language not in scale["labels"])
    assert faults == []
    form = Questionnaire.model_validate(tables["questionnaires"]["form"])
    assert set(form.scores) == set(source["scores"])
    assert set(tables["scales"]) == {Instrument(name).scale_name(scale) for scale in source.get("scales", {})}
    for item, known in zip(form.items, source["items"], strict=True):
        assert (item.id, item.kind_id) == (known["id"], known["kind"])
        context = Context(
            {name_of_scale: Scale.model_validate(scale) for name_of_scale, scale in tables["scales"].items()},
            None,
            "en",
        )
        if "from" in known:
            assert item.bounds(context) == (known["from"], known["to"])
        for language in languages:
            own = known.get("text", {}).get(language, f"own {language}")
            assert item.text == own if isinstance(item.text, str) else item.text[language] == own


def view(name: str, condition: ShowIf | None = None) -> NumberView:
    return NumberView(name, 1, "?", True, show_if=condition)


def test_question_is_shown_by_the_answer_to_an_earlier_one() -> None:
    items = [view("a"), view("b", ShowIf(item="a", values=("x", "y"))), view("c", ShowIf(item="a", at_least=3))]
    assert shown_questions(items, {}) == ("a",)
    assert shown_questions(items, {"a": "y"}) == ("a", "b")
    assert shown_questions(items, {"a": 3}) == ("a", "c")
    assert shown_questions(items, {"a": ("z", "x")}) == ("a", "b")
    assert shown_questions(items, {"a": None}) == ("a",)


def test_an_answer_to_a_hidden_question_does_not_show_others() -> None:
    items = [view("a"), view("b", ShowIf(item="a", at_most=1)), view("c", ShowIf(item="b", values=5))]
    assert shown_questions(items, {"a": 2, "b": 5}) == ("a",)
    assert shown_questions(items, {"a": 1, "b": 5}) == ("a", "b", "c")
