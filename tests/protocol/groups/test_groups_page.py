"""The page about groups: its example belongs to a study whose groups and sessions have the steps that it names."""

import re
from pathlib import Path

from study_app.protocol.groups.own_protocol import variants
from tests.protocol.groups.grouped import grouped

PAGE = (Path(__file__).parents[3] / "docs" / "groups.md").read_text(encoding="utf-8")


def test_example_of_the_page_is_a_study() -> None:
    (example,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    study = grouped(("[pages.hello]", "[pages.consent]"), groups=example)
    assert [(one.name, one.protocol.sequence) for one in variants(study)] == [
        ("group thin_first", ("consent", "thin", "thick")),
        ("group thick_first, session 1", ("consent", "thick")),
        ("group thick_first, session 2", ("thin",)),
    ]
