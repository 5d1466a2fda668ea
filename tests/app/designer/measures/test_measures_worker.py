"""The worker of slow numbers answers what the commands answer; whether the questions fit on one page."""

import time
from concurrent.futures import Executor, Future
from typing import Any

import pytest
from PySide6.QtCore import QSize, Qt

from study_app.analysis.power.threshold_studies import plans, sweep
from study_app.app.designer.measures.measures_worker import (
    THRESHOLD_STUDIES,
    Advising,
    Detecting,
    Grouping,
    MeasureOrder,
    carry_out,
)
from study_app.app.designer.measures.page_fit import _pages
from study_app.app.designer.measures.wanted import wanted_of
from study_app.authoring.edited_study import read
from study_app.authoring.measures.planned import ENOUGH
from study_app.authoring.new_study import template
from study_app.authoring.writer.edits import Set
from study_app.gui.participant.page_parts import parts_of
from study_app.gui.participant.pages.questionnaire import QuestionnaireWidget
from study_app.protocol.checks.expected_precision import imprecise
from study_app.protocol.load import load
from study_app.protocol.source.files import shipped_file
from study_app.protocol.wording.languages import words
from study_app.viewmodels.designer.measures.measures_view import Controls, focus_of
from study_app.workers.messages import Stopped


class Serial(Executor):
    """Computes each case at once."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


@pytest.mark.nightly
@pytest.mark.slow
def test_the_share_of_studies_is_that_of_the_command_power() -> None:
    protocol = template("viscosity-jnd").protocol
    assert protocol is not None
    planned = plans(protocol, (20,))
    ((done, found),) = list(sweep(planned, (6,), THRESHOLD_STUDIES, 1, Serial()))[-1:]
    answers: list[Any] = []
    carry_out(MeasureOrder((Grouping(planned["viscosity"][20], 6, 0.5),)), answers.append, lambda: False)
    *counted, (_, group) = answers
    shares = [one.done / one.total for one in counted]
    assert shares == sorted(shares)
    assert 0.0 == shares[0] < shares[-1] < 1.0
    assert done == group.studies
    assert group.share == found["viscosity", 20].within(0, 0.5)
    assert 0.0 < group.share < ENOUGH
    sizes = range(7, 13)
    ((_, found),) = list(sweep(planned, sizes, THRESHOLD_STUDIES, 1, Serial()))[-1:]
    within = [found["viscosity", 20].within(at, 0.5) for at in range(len(sizes))]
    assert group.enough == next(size for size, share in zip(sizes, within, strict=True) if share >= ENOUGH)


@pytest.mark.slow
def test_warnings_that_take_simulated_observers_are_those_of_check() -> None:
    protocol = template("viscosity-jnd").edited(Set(("analysis", "participants"), 4))[0].protocol
    assert protocol is not None
    answers: list[Any] = []
    carry_out(MeasureOrder((Advising("", protocol),)), answers.append, lambda: False)
    assert answers[0][1] == tuple(imprecise(protocol, protocol.blocks["viscosity"]))
    assert answers[0][1]


def test_what_is_wanted_depends_on_forces_and_tasks_and_on_no_text() -> None:
    study = read(shipped_file("rek2024").read_bytes(), shipped_file("rek2024").parent)
    path = ("blocks", "liquids")

    def wanted(*changes: Set) -> Detecting:
        changed, _ = study.edited(*changes)
        assert changed.formed is not None
        (one,) = wanted_of(changed.formed, focus_of(changed.formed, path), Controls())
        assert isinstance(one, Detecting)
        return one

    same = wanted(Set(("blocks", "liquids", "title", "en"), "Other"), Set(("pages", "consent", "title", "en"), "Hello"))
    assert wanted() == same
    assert wanted() != wanted(Set(("liquids", "honey", "density_kg_m3"), 1300))
    assert wanted() != wanted(Set(("tasks", "explore", "max_s"), 61))


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


def test_an_order_is_given_up_before_its_first_number() -> None:
    protocol = template("viscosity-jnd").protocol
    assert protocol is not None
    with pytest.raises(Stopped):
        carry_out(MeasureOrder((Grouping(plans(protocol, (20,))["viscosity"][20], 6, 0.5),)), print, lambda: True)
