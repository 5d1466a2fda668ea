"""The first entry of places that take long to make: the window answers meanwhile."""

import threading
from collections.abc import Iterator
from typing import Any

import pytest
from PySide6.QtWidgets import QLabel

from study_app.app import lab_and_designer
from study_app.app.lab.initial_settings import InitialSettings, prepare_initial_settings
from study_app.app.main_controller import MainController

pytestmark = pytest.mark.slow


class HeldLoading:
    """The loading of both places, which ends once ``allowed`` is set."""

    def __init__(self) -> None:
        self.began, self.allowed = threading.Event(), threading.Event()

    def load(self) -> InitialSettings:
        """Wait, then load as the program does."""
        self.began.set()
        self.allowed.wait(30.0)
        return prepare_initial_settings()


@pytest.fixture
def loading(monkeypatch: pytest.MonkeyPatch) -> Iterator[HeldLoading]:
    """Hold the loading of both places until the test, or its end, allows it."""
    held = HeldLoading()
    monkeypatch.setattr(lab_and_designer, "preload_lab_and_designer", held.load)
    yield held
    held.allowed.set()


@pytest.mark.parametrize("asked", ["edit", "new", "nothing: one went elsewhere"])
def test_a_study_that_was_asked_for_opens_once_the_designer_is_loaded(
    visit: MainController, qtbot: Any, loading: HeldLoading, asked: str
) -> None:
    both = visit.lab_and_designer
    if asked == "new":
        both.begin_study()
    else:
        both.open_designer("demo")
    assert (visit.window.here, both.designer) == ("designer", None)
    assert loading.began.wait(5.0), "loading begins at once"
    if asked.startswith("nothing"):
        visit.window.go("home")
    with qtbot.waitSignal(both.prepared):
        loading.allowed.set()
    visit.window.go("designer")
    qtbot.waitUntil(lambda: both.designer is not None and both.designer.place.isVisible())
    assert both.designer is not None
    opened = both.designer.editing.opened
    if asked == "edit":
        assert opened is not None
        assert opened.study.document["study"]["name"] == "demo"
    else:
        new_page = both.designer.place.new_page
        assert (opened, new_page.isVisible()) == (None, asked == "new")
        assert (visit.window.focusWidget() is new_page.card.questions.title) == (asked == "new")


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("name", ["lab", "designer"])
def test_nothing_waits_for_a_place_that_cannot_be_loaded_and_a_second_entry_tries_again(
    visit: MainController, qtbot: Any, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    tried: list[str] = []

    def fail() -> None:
        tried.append(name)
        raise RuntimeError("a module is missing")

    monkeypatch.setattr(lab_and_designer, "preload_lab_and_designer", fail)
    for _ in range(2):
        visit.window.go(name)
        assert visit.window.here == name
        qtbot.waitUntil(lambda: visit.window.notice is not None)
        assert visit.window.here == "home"
        said = " ".join(one.text() for one in visit.window.notice.findChildren(QLabel))
        assert "a module is missing" in said
        visit.window.notice.close()
        visit.window.notice = None
    assert tried == [name, name]
