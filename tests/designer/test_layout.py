"""Every page of the designer in windows of each size: it fits, its parts have names, none is a window of its own."""

from collections.abc import Iterator
from typing import Any

import pytest
from PySide6.QtCore import QEvent, QObject, QPoint, Qt
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QApplication,
    QComboBox,
    QLabel,
    QLineEdit,
    QPlainTextEdit,
    QWidget,
)

from study_app.designer.document.steps import ChangeLanguage
from study_app.designer.document.toml_edits import Set
from study_app.designer.outline import addable_elements
from study_app.gui.theme.theme import DARK, LIGHT
from study_app.gui.widgets.cards import Chip
from study_app.gui.widgets.labels import Elided
from tests.designer.support.inputs import name_of

pytestmark = [pytest.mark.slow, pytest.mark.variants(2)]

TAKE_KEYS = (QAbstractButton, QLineEdit, QPlainTextEdit, QComboBox, QAbstractItemView)
ICON_AND_PADDING_PX = 18 + 4 + 2 * 10
SIZES = pytest.mark.parametrize("size", [(1024, 640), (1366, 768), (1600, 1000)])


class Shown(QObject):
    """An event filter that records every shown window."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.windows: list[str] = []

    def eventFilter(self, part: Any, event: QEvent) -> bool:  # noqa: N802 - Qt's name
        window = event.type() == QEvent.Type.Show and isinstance(part, QWidget) and part.isWindow()
        if window and part.graphicsProxyWidget() is None:  # the participant's page lies within the designer
            self.windows.append(type(part).__name__)
        return False


@pytest.fixture
def windows(designer: Any) -> Iterator[list[str]]:
    """Return the windows that are shown during a test."""
    watch = Shown(designer.window)
    QApplication.instance().installEventFilter(watch)
    yield watch.windows
    QApplication.instance().removeEventFilter(watch)


def fits(area: Any) -> bool:
    return bool(area.widget().minimumSizeHint().width() <= area.viewport().width())


def nameless(place: Any) -> list[QWidget]:
    """Return the visible widgets that take the keyboard but have no name, except the inner widgets of lists."""
    own = [part for part in place.findChildren(QWidget) if isinstance(part, TAKE_KEYS) and part.isVisible()]
    within = {inner for part in own if isinstance(part, QComboBox) for inner in part.findChildren(QWidget)}
    takes_keys = [part for part in own if part not in within and part.focusPolicy() != Qt.FocusPolicy.NoFocus]
    return [part for part in takes_keys if not name_of(part)]


def cut(place: Any) -> list[str]:
    """Return the texts of chips, empty fields and wrapped labels that are cut off."""
    chips = [
        chip for chip in place.form.findChildren(Chip) if chip.isVisible() and chip.width() < chip.sizeHint().width()
    ]
    lines = [line for line in place.form.inside.findChildren(QLineEdit) if line.isVisible() and not line.text()]
    room = [line.width() - line.fontMetrics().horizontalAdvance(line.placeholderText()) for line in lines]
    wrapped = [label for label in place.form.inside.findChildren(QLabel) if label.isVisible() and label.wordWrap()]
    return [
        *(chip.word for chip in chips),
        *(line.placeholderText() for line, width in zip(lines, room, strict=True) if width < 0),
        *(label.text() for label in wrapped if label.height() < label.heightForWidth(label.width())),
    ]


def go_through_forms(designer: Any) -> None:
    place = designer.place
    for path in [row.path for row in place.outline.rows if row.path]:
        designer.go_to(*path)
        assert fits(place.form.area), path
        assert not nameless(place), path
        assert not cut(place), path


@SIZES
def test_every_form_and_view_fits_and_has_names(
    designer: Any, editors: None, windows: list[str], size: tuple[int, int]
) -> None:
    designer.window.resize(*size)
    designer.open()
    place = designer.place
    assert place.form.isVisible()
    assert place.pane.isVisible() == (size[0] > 1200)
    go_through_forms(designer)
    for button in place.pane.tabs.buttons:
        place.sides.buttons[1].click()
        button.click()
        QApplication.processEvents()
        assert place.pane.width() > (0.4 if place.form.isVisible() else 0.95) * place.parts.width()
        assert not nameless(place), button.text()
    designer.controller.ask_to_delete(("liquids", "thick"))
    assert not nameless(place)
    assert (designer.window.width(), designer.window.height()) == size
    assert not windows


@SIZES
def test_a_block_without_a_design_fits(designer: Any, editors: None, size: tuple[int, int]) -> None:
    """Such a block offers the keys with the longest names; a form that does not fit is cut off on the left."""
    designer.window.resize(*size)
    designer.controller.begin_study("template:empty", "mine")
    designer.go_to("blocks", "liquids")
    assert fits(designer.place.form.area)


@SIZES
@pytest.mark.parametrize("theme", [LIGHT, DARK])
def test_measures_and_the_page_of_a_new_study_fit(
    qtbot: Any, designer: Any, windows: list[str], size: tuple[int, int], theme: Any
) -> None:
    designer.window.show_theme(theme)
    designer.window.resize(*size)
    designer.controller.show_new_page()
    page = designer.place.new_page
    for button in page.buttons:
        button.setChecked(True)
        qtbot.wait(1)
        assert fits(page.card.area), button.choice.source
        assert page.card.questions.title.width() == page.card.questions.width(), "a title is long"
        assert not nameless(page), button.choice.source
    designer.controller.begin_study("template:viscosity-jnd", "thicker")
    designer.place.sides.buttons[1].click()
    designer.place.pane.show_tab("measures")
    measures = designer.place.measures
    for path in (("blocks", "viscosity"), ("liquids", "damper"), ("study",), ("designs", "pair"), ("tasks", "stir")):
        designer.go_to(*path)
        designer.controller.measures.show_measures()
        assert measures.shown is not None
        assert fits(measures), path
        assert not nameless(measures), path
    assert (designer.window.width(), designer.window.height()) == size
    assert not windows


def test_the_second_side_of_a_hypothesis_is_whole_in_a_narrow_window(designer: Any) -> None:
    designer.controller.begin_study("template:two-liquids-abx", "parts")
    designer.window.resize(1366, 768)
    contrast = {"measure": "d_prime", "blocks": ["liquids"], "groups": ["novice", "experienced"]}
    designer.editing.make_step(
        "Change", Set(("groups", "novice"), {}), Set(("groups", "experienced"), {}),
        Set(("blocks", "liquids", "title"), "the green part, one bit late"),
        Set(("analysis", "contrasts"), [contrast]),
    )  # fmt: skip
    designer.go_to("analysis")
    (line,) = designer.field("analysis", "contrasts").lines
    assert line.second.currentText() == "Experienced in the green part, one bit late"
    boxes = (line.measure, line.relation, line.second)
    assert [box.toolTip() for box in boxes if box.grab()] == [""] * 3, "a tip shows the text that is elided"


def test_each_addable_element_and_the_count_of_texts_are_whole(designer: Any) -> None:
    designer.open("kitchen", "study", width=1366)
    adding = designer.place.adding
    adding.open(addable_elements(designer.study, ("study",)), QPoint(100, 600))
    room = adding.list.viewport().width() - ICON_AND_PADDING_PX
    assert max(adding.list.fontMetrics().horizontalAdvance(adding.list.item(at).text()) for at in range(30)) < room
    adding.close()
    designer.editing.handle_request(ChangeLanguage("add", "fr"))
    QApplication.processEvents()
    row = designer.field("study", "languages").rows[-1]
    (note,) = (part for part in row.findChildren(Elided) if " of " in part.whole)
    assert note.width() >= note.fontMetrics().horizontalAdvance(note.whole.partition(",")[0])
