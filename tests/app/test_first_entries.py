"""The first visit of places that take long to make: what was asked for is opened there, and a failure is said."""

from typing import Any

import pytest
from PySide6.QtWidgets import QLabel

from study_app.app.main_controller import MainController

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("asked", ["edit", "new"])
def test_a_study_that_was_asked_for_opens_at_the_first_visit(visit: MainController, qtbot: Any, asked: str) -> None:
    visit.preload()
    if asked == "new":
        visit.begin_new_study()
    else:
        visit.open_designer("demo")
    designer = visit.designer
    assert designer is not None
    assert (visit.window.here, designer.place.isVisible()) == ("designer", True)
    opened, new_page = designer.editing.opened, designer.place.new_page
    if asked == "edit":
        assert opened is not None
        assert opened.study.document["study"]["name"] == "demo"
    else:
        assert (opened, new_page.isVisible()) == (None, True)
        assert visit.window.focusWidget() is new_page.card.questions.title


@pytest.mark.parametrize(
    ("name", "controller"), [("lab", "app.lab_controller.Lab"), ("designer", "designer.controller.Designer")]
)
def test_a_place_that_cannot_be_made_is_said_and_a_second_visit_tries_again(
    visit: MainController, qtbot: Any, monkeypatch: pytest.MonkeyPatch, name: str, controller: str
) -> None:
    tried: list[str] = []

    def fail(*_: Any, **__: Any) -> None:
        tried.append(name)
        raise RuntimeError("a module is missing")

    monkeypatch.setattr(f"study_app.{controller}Controller", fail)
    for _ in range(2):
        with pytest.raises(RuntimeError, match="a module is missing"):
            visit.window.go(name)
        assert visit.window.here == "home"
        said = " ".join(one.text() for one in visit.window.notice.findChildren(QLabel))
        assert "a module is missing" in said
        visit.window.notice.close()
        visit.window.notice = None
    assert tried == [name, name]
