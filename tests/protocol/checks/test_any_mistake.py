"""Whatever is written in place of a value, or left out, is a fault with its line and no other error."""

import re
from collections.abc import Iterator

import pytest

from study_app.errors import ProtocolError
from study_app.protocol.load import parse
from tests.protocol.forms.mixed import MIXED
from tests.protocol.groups.grouped import GROUPS, STUDY
from tests.protocol.trials.level_studies import BLOCK, HEAD

pytestmark = pytest.mark.slow

VALUE = re.compile(r'(?<== )("[^"]*"|\[[^\[\]=]*\]|[-\d.]+|true|false)')
WRONG = ('"rating"', "{}", '{ nl = "x" }', '[1, { nl = "x" }]', "-1e308")


def mistakes(text: str) -> Iterator[str]:
    lines = text.split("\n")
    for number in range(len(lines)):
        yield "\n".join(lines[:number] + lines[number + 1 :])
    for match in VALUE.finditer(text):
        for wrong in WRONG:
            yield text[: match.start()] + wrong + text[match.end() :]


def is_refused(text: str) -> bool:
    try:
        parse(text.encode(), "wrong")
    except ProtocolError:
        return True
    return False


@pytest.mark.parametrize("text", [HEAD + BLOCK, STUDY + GROUPS, MIXED], ids=["levels", "groups", "questions"])
def test_any_mistake_is_a_protocol_error(text: str) -> None:
    assert sum(map(is_refused, mistakes(text))) > len(text.splitlines())
