"""The first visit to pages that take long to create: the requested study is opened, and a failure is reported."""

from typing import Any

import pytest
from PySide6.QtWidgets import QLabel

from study_app.app.main_controller import MainController

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("action", ["edit", "new"])
def test_a_requested_study_opens_at_the_first_visit(visit: MainController, qtbot: Any, action: str) -> None:
    visit.preload()
    if action == "new":
        visit.begin_new_study()
    else:
        visit.open_designer("demo")
    designer = visit.designer
    assert designer is not None
    assert (visit.window.here, designer.place.isVisible()) == ("designer", True)
    document, new_page = designer.editing.opened, designer.place.new_page
    if action == "edit":
        assert document is not None
        assert document.study.document["study"]["name"] == "demo"
    else:
        assert (document, new_page.isVisible()) == (None, True)
        assert visit.window.focusWidget() is new_page.card.questions.title


@pytest.mark.parametrize(
    ("name", "controller"), [("lab", "app.lab_controller.Lab"), ("designer", "designer.controller.Designer")]
)
def test_a_page_that_cannot_be_created_is_reported_and_retried_at_the_next_visit(
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
        said = " ".join(label.text() for label in visit.window.notice.findChildren(QLabel))
        assert "a module is missing" in said
        visit.window.notice.close()
        visit.window.notice = None
    assert tried == [name, name]
