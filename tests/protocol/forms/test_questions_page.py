"""The page about questions: its example is a study, and its tables name what there is."""

import re
from pathlib import Path

from study_app.protocol.forms.kinds import KINDS, STATEMENT
from study_app.protocol.instruments.instrument import instrument, instruments
from study_app.protocol.load import parse

PAGE = (Path(__file__).parents[3] / "docs" / "questions.md").read_text(encoding="utf-8")


def test_example_of_the_page_is_a_study() -> None:
    (example,) = (one for one in re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL) if one.startswith("format = 2"))
    study = parse(example.encode(), "example")
    assert list(study.forms) == ["about_you", "comment"]
    assert [item.kind_id for item in study.questionnaires["after"].items] == ["rating", "slider"]


def test_tables_of_the_page_name_every_kind_and_instrument() -> None:
    named = set(re.findall(r"^\| `([\w-]+)` \|", PAGE, re.MULTILINE))
    assert set(KINDS) - {STATEMENT} <= named
    assert set(instruments()) <= named
    for name in instruments():
        (line,) = (line for line in PAGE.splitlines() if line.startswith(f"| `{name}` |"))
        assert set(re.findall(r"`(\w+)`", line.split("|")[3])) == set(instrument(name)["scores"])
