"""Parts of windows, compared with a reviewed text: what each paints, tells and asks room for in its states."""

from collections.abc import Iterator
from typing import Any

import pytest
from PySide6.QtWidgets import QWidget

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
    monkeypatch.setattr("study_app.gui.help.view.text_of", lambda _name: PAGE_TEXT)
    make, size, actions = PARTS[name]
    part = shown(qtbot, make(), size)
    qtbot.waitUntil(part.isActiveWindow)
    settle(part)
    lines = [*rooms(part), *states(part, actions, lambda: settle(part))]
    compare(f"part {name}", lines, pytestconfig)
