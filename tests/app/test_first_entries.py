"""The first entry of places that take long to make: the window answers meanwhile."""

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtWidgets import QLabel

from study_app.app import lab_and_designer
from study_app.app.lab.initial_settings import InitialSettings, prepare_initial_settings
from study_app.app.main_controller import MainController


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


@pytest.mark.parametrize("name", ["lab", "designer"])
def test_a_place_is_not_made_while_a_thread_loads_what_it_needs(
    qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, loading: HeldLoading, name: str
) -> None:
    made: list[str] = []
    monkeypatch.setattr(lab_and_designer.LabAndDesigner, f"make_{name}", lambda _self: made.append(name))
    visit = MainController(tmp_path / "results")
    qtbot.addWidget(visit.window)
    visit.window.show()
    visit.lab_and_designer.prepare_lab()  # as once the window stands
    visit.window.go(name)
    assert (visit.window.here, made) == (name, [])
    assert loading.began.wait(5.0)
    visit.window.go("home")
    visit.window.close()
    visit.end()


@pytest.mark.slow
@pytest.mark.parametrize("asked", ["edit", "new"])
def test_a_study_that_was_asked_for_opens_once_the_designer_is_loaded(
    qtbot: Any, tmp_path: Path, loading: HeldLoading, asked: str
) -> None:
    visit = MainController(tmp_path / "results")
    both = visit.lab_and_designer
    qtbot.addWidget(visit.window)
    visit.window.show()
    if asked == "edit":
        both.open_designer("demo")
    else:
        both.begin_study()
    assert (visit.window.here, both.designer) == ("designer", None)
    assert loading.began.wait(5.0), "loading begins at once"
    loading.allowed.set()
    qtbot.waitUntil(lambda: both.designer is not None and both.designer.place.isVisible())
    assert both.designer is not None
    opened = both.designer.editing.opened
    if asked == "edit":
        assert opened is not None
        assert opened.study.document["study"]["name"] == "demo"
    else:
        new_page = both.designer.place.new_page
        assert (opened, new_page.isVisible()) == (None, True)
        assert visit.window.focusWidget() is new_page.card.questions.title
    visit.window.close()
    visit.end()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("name", ["lab", "designer"])
def test_nothing_waits_for_a_place_that_cannot_be_loaded_and_a_second_entry_tries_again(
    qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    tried: list[str] = []

    def fail() -> None:
        tried.append(name)
        raise RuntimeError("a module is missing")

    monkeypatch.setattr(lab_and_designer, "preload_lab_and_designer", fail)
    visit = MainController(tmp_path / "results")
    qtbot.addWidget(visit.window)
    visit.window.show()
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
    visit.window.close()
    visit.end()


@pytest.mark.slow
def test_a_study_that_was_asked_for_is_forgotten_where_one_goes_elsewhere_before_the_designer_is_loaded(
    qtbot: Any, tmp_path: Path, loading: HeldLoading
) -> None:
    visit = MainController(tmp_path / "results")
    both = visit.lab_and_designer
    qtbot.addWidget(visit.window)
    visit.window.show()
    both.open_designer("demo")
    visit.window.go("home")
    with qtbot.waitSignal(both.prepared):
        loading.allowed.set()
    visit.window.go("designer")
    qtbot.waitUntil(lambda: both.designer is not None and both.designer.place.isVisible())
    qtbot.wait(100)
    assert both.designer is not None
    assert both.designer.editing.opened is None
    visit.window.close()
    visit.end()
