"""Whether the questions fit on one page: as the window of a session divides them."""

import time
from typing import Any

import pytest
from PySide6.QtCore import QSize, Qt

from study_app.app.designer.measures.page_fit import PageFit, _pages
from study_app.gui.participant.page_parts import parts_of
from study_app.gui.participant.pages.questionnaire import QuestionnaireWidget
from study_app.protocol.load import load
from study_app.protocol.wording.languages import words
from study_app.viewmodels.designer.measures.measures_view import focus_of

PATH = ("questionnaires", "liquid")


@pytest.mark.slow
@pytest.mark.parametrize(("size", "expected"), [((1366, 768), 1), ((1024, 560), 2), ((800, 420), 3)])
def test_a_page_never_shown_has_the_parts_of_one_that_is(qtbot: Any, size: tuple[int, int], expected: int) -> None:
    protocol = load("rek2024")
    (page, language), _ = _pages(protocol, focus_of(protocol, PATH), PATH)
    shown = QuestionnaireWidget(page, words(language), time.monotonic)
    qtbot.addWidget(shown)
    shown.setAttribute(Qt.WidgetAttribute.WA_DontShowOnScreen)
    shown.resize(QSize(*size))
    shown.show()
    assert parts_of(page, words(language), size) == len(shown.parts) == expected


@pytest.mark.slow
def test_the_fit_is_found_once_for_each_page_and_language(qtbot: Any, qapp: Any) -> None:
    protocol = load("rek2024")
    fit = PageFit(qapp)
    fit.rest.setInterval(1)
    focus = focus_of(protocol, PATH)
    assert fit.parts(protocol, focus, PATH) is None
    qtbot.waitSignal(fit.found).wait()
    assert fit.parts(protocol, focus, PATH) == 1
    assert not fit.rest.isActive()
    assert fit.parts(protocol, focus_of(protocol, ("study",)), ("study",)) is None
