"""The designer's header: what is at its left edge, with and without its title."""

from collections.abc import Iterator
from itertools import product
from typing import Any

import pytest
from PySide6.QtWidgets import QApplication, QWidget

from study_app.gui.designer.designer_header import DesignerHeader
from study_app.gui.widgets.cards import SHADOW
from study_app.viewmodels.designer.designer_view import HeaderState, StudyChoice
from study_app.viewmodels.designer.versions.standing import VersionChip


@pytest.fixture
def header(qtbot: Any, width: int) -> Iterator[DesignerHeader]:
    """A header of a width; one that is a window itself would take the width that it needs."""
    around = QWidget()
    qtbot.addWidget(around)
    made = DesignerHeader()
    made.setParent(around)
    made.resize(width, 60)
    around.resize(width, 60)
    around.show()
    yield made
    around.close()


def test_the_list_of_studies_is_at_the_edge_where_the_title_has_no_room(qtbot: Any) -> None:
    header = DesignerHeader()
    qtbot.addWidget(header)
    header.resize(1200, 60)
    header.show()
    QApplication.processEvents()
    assert header.title.x() == SHADOW
    assert header.study.x() > header.title.geometry().right()
    header.title.hide()
    header.layout().activate()
    QApplication.processEvents()
    assert header.study.x() == SHADOW


def test_the_name_of_the_study_comes_before_the_title_of_the_place(qtbot: Any) -> None:
    header = DesignerHeader()
    qtbot.addWidget(header)
    header.resize(1246, 60)
    header.show()
    study = StudyChoice("Honey in the kitchen", "honey.toml", "honey")
    header.show_state(HeaderState((study,), "honey", draft="Saved"))
    QApplication.processEvents()
    assert not header.title.isVisible()
    assert header.study.width() > header.study.fontMetrics().horizontalAdvance(study.title) + 60
    header.resize(1600, 60)
    QApplication.processEvents()
    assert header.title.isVisible()


@pytest.mark.parametrize("width", [900, 1100, 1246])
def test_the_state_of_the_draft_is_seen_beside_a_long_title(header: DesignerHeader, width: int) -> None:
    study = StudyChoice("Preference between drinking liquids of different thickness, pilot A", "a.toml", "a")
    problems = ("bad", "warning", "24 problems")
    version = VersionChip("neutral", "ring", "Not run yet")
    header.show_state(HeaderState((study,), "a", problems, "Draft kept 22:51", can_save=True, version=version))
    QApplication.processEvents()
    assert header.draft.isVisible()
    assert header.save.geometry().right() <= width


@pytest.mark.parametrize("width", [927, 1246, 1360, 1480, 1560])
def test_nothing_moves_where_a_chip_says_other_words(header: DesignerHeader) -> None:
    studies = (StudyChoice("Feeling simulated liquids", "rek2024.toml", "a"),)
    parts = (header.title, header.study, header.problems, header.draft, header.version, header.play)
    places = set()
    for draft, problems, version in product(
        ("Saved", "Not saved yet", "Draft kept 14:02"),
        ("No problems", "1 problem", "12 problems"),
        ("Not run yet", "1.2, was 1.1"),
    ):
        chip = VersionChip("neutral", "ring", version)
        header.show_state(HeaderState(studies, "a", ("ok", "check", problems), draft, can_save=True, version=chip))
        QApplication.processEvents()
        places.add((header.study.width(), *(part.isVisible() and part.x() for part in parts)))
    assert len(places) == 1, places
