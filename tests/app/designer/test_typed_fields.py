"""Fields that are typed in: what is shown is no edit, and what is pasted stays as it is within a line."""

from __future__ import annotations

from typing import Any

import pytest

from study_app.gui.designer.form.typed_fields import HAND_ON_MS, TypedSentence, TypedText

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("kind", [TypedText, TypedSentence])
@pytest.mark.parametrize("text", ["a\rb", "a\u2029b", "a\r\nb"])
def test_a_shown_text_that_qt_normalises_is_no_edit(qtbot: Any, kind: type[TypedText], text: str) -> None:
    field = kind("Text")
    qtbot.addWidget(field)
    typed: list[str] = []
    field.typed.connect(typed.append)
    field.show_text(text)
    assert not field.pending
    qtbot.wait(2 * HAND_ON_MS)
    assert typed == []
    field.insertPlainText("c")
    assert field.pending
    field.flush()
    assert typed == ["ca\nb"]
