"""Parts of windows, compared with a reviewed text: what each paints, tells and asks room for in its states."""

from collections.abc import Iterator
from typing import Any

import pytest
from PySide6.QtWidgets import QWidget

from study_app.gui.help import reader
from study_app.gui.participant.pages.statement_field import statement_height
from tests.gui.parts import PAGE_TEXT, PARTS
from tests.gui.transcript import compare, states
from tests.gui.walk import settle
from tests.gui.windows import shown


def rooms(part: QWidget) -> Iterator[str]:
    """Yield the sizes that the program's own parts ask for."""
    for one in [part, *part.findChildren(QWidget)]:
        if one.isVisible() and type(one).__module__.startswith("study_app"):
            sizes = (one.sizeHint(), one.minimumSizeHint(), one.size())
            yield " ".join([type(one).__name__, *(f"{size.width()}x{size.height()}" for size in sizes)])


@pytest.mark.parametrize("name", PARTS)
def test_what_a_part_paints_and_tells(
    qtbot: Any, name: str, monkeypatch: pytest.MonkeyPatch, pytestconfig: pytest.Config
) -> None:
    monkeypatch.setattr(reader, "text_of", lambda _name: PAGE_TEXT)
    make, size, actions = PARTS[name]
    part = shown(qtbot, make(), size)
    qtbot.waitUntil(part.isActiveWindow)
    settle(part)
    lines = [*rooms(part), *states(part, actions, lambda: settle(part))]
    compare(f"part {name}", lines, pytestconfig)


def test_a_statement_is_as_high_as_its_lines(qapp: Any) -> None:
    text = "The force was the same in both"
    line, lines = (statement_height(text, 1.0, 400, width_px) for width_px in (2000, 150))
    assert lines == pytest.approx(2 * line, abs=2)
    assert statement_height(text, 2.0, 400, 2000) == pytest.approx(2 * line, abs=3)
    assert statement_height("\n".join("abc"), 1.0, 400, 2000) == pytest.approx(3 * line, abs=3)
