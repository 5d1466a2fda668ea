"""Who must not know what is felt: said by the protocol, kept by the receipt."""

import pytest

from study_app.errors import ProtocolError
from study_app.protocol.describe import describe
from study_app.protocol.load import parse, source_bytes
from study_app.protocol.source.json_schema import schema
from study_app.store.receipt import without_conditions

DEMO = source_bytes("demo").decode()
SAYS = 'blinding = "double"'


def told(line: str) -> bytes:
    assert DEMO.count(SAYS) == 1
    return DEMO.replace(SAYS, line).encode()


def test_a_study_is_double_blind_unless_it_says_otherwise() -> None:
    assert parse(told(""), "demo").study.blinding == "double"
    assert parse(told(SAYS), "demo").study.blinding == "double"
    assert parse(told('blinding = "single"'), "demo").study.blinding == "single"


@pytest.mark.parametrize("word", ['"none"', '"Double"', "false"])
def test_nothing_but_the_two_is_taken(word: str) -> None:
    with pytest.raises(ProtocolError, match=r"study\.blinding"):
        parse(told(f"blinding = {word}"), "demo")


@pytest.mark.parametrize("blinding", ["double", "single"])
def test_the_receipt_keeps_which_it_was(blinding: str) -> None:
    protocol = parse(told(f'blinding = "{blinding}"'), "demo")
    assert without_conditions(protocol)["study"]["blinding"] == blinding
    assert f"{blinding}-blind" in describe(protocol)


def test_editors_are_told_both_and_the_default() -> None:
    node = schema()["$defs"]["StudyHead"]["properties"]["blinding"]
    assert (node["enum"], node["default"]) == (["double", "single"], "double")
    assert "the participant does not know" in node["description"]
