import pytest
from pydantic import ValidationError

from study_app.errors import ProtocolError
from study_app.protocol.load import load, parse
from study_app.protocol.model import Limits, Protocol
from study_app.protocol.orders.block_orders import orders_of
from study_app.protocol.texts import tidy
from tests.protocol.sound import SOUND

SMALL = parse(SOUND.encode(), "small.toml")


def test_a_completeness_that_is_not_asked_for_stands_in_no_file():
    assert "targets_percent" not in Limits().model_dump(mode="json")
    assert Limits(targets_percent=80).model_dump(mode="json")["targets_percent"] == 80


def test_a_protocol_never_changes():
    with pytest.raises(ValidationError, match="frozen"):
        SMALL.study.name = "other"  # type: ignore[misc]


@pytest.mark.parametrize("protocol", [SMALL, load("rek2024"), load("demo")], ids=lambda protocol: protocol.study.name)
def test_a_protocol_survives_json(protocol: Protocol):
    assert Protocol.model_validate_json(protocol.model_dump_json()) == protocol


def test_code_reads_si_units():
    assert SMALL.device.workspace_m == (0.1, 0.06, 0.06)
    assert SMALL.delay_s("both") == 0.12
    reach = SMALL.tasks["reach"]
    assert reach.kind == "reach"
    assert (reach.targets_m, reach.radius_m) == (((-0.03, 0, 0), (0.03, 0, 0)), 0.006)


def test_a_scene_holds_the_liquids_of_its_condition_in_order():
    scene = SMALL.scene_for("both")
    assert [liquid.id for liquid in scene.liquids] == ["thin", "thick"]
    assert (scene.scale, scene.rate_hz, scene.force_limit_n) == (10, 1000, 8)


def test_blocks_come_in_the_order_of_the_sequence():
    assert [block.id for block in SMALL.blocks_in_order] == ["warm_up", "feel", "look"]
    assert [block.id for block in SMALL.main_blocks] == ["feel", "look"]
    assert SMALL.parts == 2


def test_responses_count_repetitions():
    assert orders_of(SMALL).answers == 2 * 2 * 2 + 2 * 2


def test_items_are_found_by_id():
    questionnaire = SMALL.questionnaires["short"]
    assert SMALL.text(questionnaire.item("cold").text, "nl") == "Het is koud."
    with pytest.raises(KeyError, match="tepid"):
        questionnaire.item("tepid")
    assert SMALL.questionnaire_of("feel") is questionnaire
    assert SMALL.questionnaire_of("warm_up") is None


def test_lines_of_the_file_do_not_matter_in_a_text():
    assert tidy("\n  One\n two.\n\n\n \t\nThree. \n") == "One two.\n\nThree."
    body = load("rek2024").pages["part_1"].body
    first, second = SMALL.paragraphs(body, "en")
    assert first == "You will now feel three liquids, one after the other. We do not tell you which they are."
    assert second.startswith("Explore each")


def test_one_string_is_a_text_in_any_language():
    assert SMALL.text("Same", "nl") == "Same"


def test_a_study_without_main_block_is_refused():
    text = SOUND
    for letter, part in (("L", 1), ("D", 2)):
        text = text.replace(f'code_prefix = "{letter}"\n', "").replace(f"part = {part}\n", 'phase = "baseline"\n')
    text = text.replace('["is_thin", "is_thick"]', '["is_thin"]').replace('["on_time", "both"]', '["is_thin"]')
    with pytest.raises(ProtocolError, match="there is no main block"):
        parse(text.encode(), "small.toml")


def test_a_language_the_program_cannot_speak_is_refused():
    text = SOUND.replace('"nl"]', '"fi"]').replace("nl = ", "fi = ").replace("labels.nl", "labels.fi")
    with pytest.raises(ProtocolError, match=r'line 8: study.languages.2: the program has no words in "fi"') as caught:
        parse(text.encode(), "small.toml")
    assert len(caught.value.problems) == 1
