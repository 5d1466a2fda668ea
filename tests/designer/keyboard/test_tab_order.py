"""Tab through the place: header, outline, form, tabs of the views, what is beside them, the page; then the rail."""

from collections.abc import Callable
from typing import Any

import pytest
from PySide6.QtWidgets import QApplication, QWidget

from study_app.designer.document.steps import ChangeLanguage
from study_app.designer.place.view import stops

pytestmark = pytest.mark.slow

MOST = 250


@pytest.fixture
def dutch(qtbot: Any, designer: Any) -> Any:
    """The study in two languages, with a block selected."""
    designer.open()
    for how in ("add", "copy"):
        designer.editing.ask(ChangeLanguage(how, "nl"))
    designer.go_to("blocks", "liquids")
    qtbot.waitUntil(lambda: len(designer.controller.preview.languages.buttons) == 2)
    return designer


def passed(designer: Any, until: Callable[[QWidget], bool]) -> list[Any]:
    """Press Tab until the keyboard is at a part; return all that it was at."""
    seen = [designer.keyboard]
    while not until(seen[-1]):
        assert len(seen) < MOST, [one.accessibleName() for one in seen[-40:]]
        seen.append(designer.hit("Tab"))
    return seen


@pytest.mark.parametrize("width", [1600, 1366])
def test_tab_goes_through_the_parts_as_they_are_seen(dutch: Any, width: int) -> None:
    dutch.window.resize(width, 800)
    QApplication.processEvents()
    place, rail = dutch.place, dutch.window.rail
    place.areas.focus_header()
    seen = passed(dutch, lambda part: part is place.pane.tabs.buttons[0])
    parts = [place.header, place.parts.path if width < 1400 else place.outline, place.form.head, place.form.inside]
    areas = [next((at for at, part in enumerate(parts) if part.isAncestorOf(one)), len(parts)) for one in seen]
    assert areas == sorted(areas)
    assert set(areas) == set(range(len(parts) + 1))
    assert place.form.rows[0].isAncestorOf(seen[areas.index(3)])
    for crumb in place.parts.path.steps:
        assert (crumb in seen) == (width < 1400)
    tab = dutch.controller.preview
    seen = passed(dutch, lambda part: part is tab.page)
    assert seen == [*place.pane.tabs.buttons, *tab.languages.buttons, tab.screens, tab.page]
    tab.page.left.emit()
    assert rail.isAncestorOf(passed(dutch, lambda part: not place.isAncestorOf(part))[-1])


@pytest.mark.variants(4)
@pytest.mark.parametrize(
    "path", [("blocks", "liquids"), ("questionnaires", "liquid"), ("tasks", "reach"), ("liquids", "thin"), ("study",)]
)
def test_tab_goes_to_each_stop_of_a_form_once(dutch: Any, editors: None, path: tuple[str | int, ...]) -> None:
    del editors
    dutch.go_to(*path)
    form = dutch.place.form
    assert form.rows
    QApplication.processEvents()
    dutch.place.areas.focus_header()
    seen = passed(dutch, lambda part: part is dutch.place.pane.tabs.buttons[0])
    assert [part.accessibleName() for part in seen if form.inside.isAncestorOf(part)] == [
        part.accessibleName() for part in stops(form.inside) if part.isVisible() and part.isEnabled()
    ]


def test_tab_goes_through_problems_questions_and_the_banner_which_are_made_later(
    qtbot: Any, designer: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("study_app.designer.problems.problems.REST_MS", 0)
    designer.open()
    designer.editing.ask(ChangeLanguage("add", "nl"))
    designer.saving.save()
    place = designer.place
    place.problems.show()
    place.show_tab("changes")
    qtbot.waitUntil(lambda: all(line.repairs for line in place.problems.lines))
    designer.controller.ask_to_delete(("liquids", "thick"))
    qtbot.waitUntil(place.prompt.isVisible)
    place.areas.focus_header()
    designer.hit("Tab")
    seen = passed(designer, lambda part: part is place.header.study or designer.window.rail.isAncestorOf(part))
    lines = [part for line in place.problems.lines for part in (line.go, *line.repairs)]
    card = place.prompt
    made = [*place.banner.buttons.values(), place.outline.tree, card.cancel, card.gaps, card.other, card.all, *lines]
    assert [part for part in seen if part in made] == made
    assert len(set(seen)) == len(seen)
