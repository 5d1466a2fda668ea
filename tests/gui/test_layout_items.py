"""No window reads the items of its layouts."""

import re

import pytest

from tests.documented import ROOT

READ = re.compile(r"\.(itemAt|takeAt|itemAtPosition|replaceWidget)\(")


@pytest.mark.parametrize(
    "text", ["self.grid.takeAt(0)", "self.column.itemAt(0).layout()", "row.replaceWidget(old, new)"]
)
def test_code_that_reads_an_item_is_found(text: str) -> None:
    assert READ.search(text)


def test_no_window_reads_the_items_of_its_layouts() -> None:
    """PySide keeps the wrapper of an item that Qt has deleted; an event at the same address would get its class."""
    found = [path for path in (ROOT / "study_app" / "gui").rglob("*.py") if READ.search(path.read_text("utf-8"))]
    assert found == []
