"""Fixtures of the designer in the main window."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from PySide6.QtWidgets import QFileDialog

from tests.designer.support.designer import DEMO, Designer
from tests.designer.support.story import NEVER_MS, Story


@pytest.fixture
def designer(qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Designer]:
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    designer = Designer(tmp_path)
    qtbot.waitUntil(designer.window.isActiveWindow)
    yield designer
    designer.close()


@pytest.fixture
def story(designer: Designer, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Story]:
    """Return a function that begins a story: the live page is frozen, typing is one step, and drafts are due."""
    for module in ("document.document", "editing", "participant.preview"):
        monkeypatch.setattr(f"study_app.designer.{module}.time", SimpleNamespace(perf_counter=lambda: 1000.0))
    monkeypatch.setattr("study_app.designer.saving.time", SimpleNamespace(perf_counter=lambda: 2000.0))
    for timer in (
        "saving._DRAFT_CHECK",
        "form.fields.SUBMIT_DELAY",
        "form.fields.CLICK",
        "file.SUBMIT_DELAY",
        "problems._PAUSE",
    ):
        monkeypatch.setattr(f"study_app.designer.{timer}_MS", NEVER_MS)  # each is let go by the story, after an act
    spoken: list[str] = []
    for module in ("header", "window"):
        monkeypatch.setattr(f"study_app.designer.{module}.announce", lambda _by, words: spoken.append(words))
    return partial(Story, designer, spoken)


@pytest.fixture
def tell_story(story: Callable[..., Story], monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Return the function that tells a story about the demo or another study, and then undoes and redoes every step."""

    def tell_and_undo(tell: Callable[[Story], None], text: str = DEMO) -> None:
        begun = story(text)
        monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(begun.designer.file), ""))
        tell(begun)
        begun.undo_and_redo()

    return tell_and_undo


@pytest.fixture(params=["special editors", "no special editors"])
def editors(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run a test with the special editors and without any."""
    if request.param == "no special editors":
        monkeypatch.setattr("study_app.designer.form.card.EDITORS", {})
