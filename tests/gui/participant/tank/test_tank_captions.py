"""The words around the tank: how long a task still lasts, and what stands above it."""

from typing import Any

import pytest

from study_app.gui.participant.tank.captions import Captions
from study_app.protocol.wording.languages import LANGUAGES, words
from tests.gui.small import explore, reach, task_page, view

pytestmark = pytest.mark.usefixtures("qapp")

EXPLORING = explore()  # from 30 to 120 s
COUNTING = reach(timeout_s=60)
TIMED = reach(count=None, duration_s=30)


def hint(task: Any, elapsed_s: float, language: str = "en") -> Any:
    captions = Captions(task_page(task), words(language))
    return captions.things(view(elapsed_s=elapsed_s).task)["hint"].state


@pytest.mark.parametrize(
    ("task", "elapsed_s", "told"),
    [
        (EXPLORING, 109.0, "Press the space bar to go on"),
        (EXPLORING, 110.5, "Press the space bar to go on · 10 s left"),
        (EXPLORING, 120.0, "Time is up"),
        (COUNTING, 49.0, ""),
        (COUNTING, 50.0, "10 s left"),
        (COUNTING, 59.5, "1 s left"),
        (COUNTING, 60.0, "Time is up"),
        (TIMED, 3.0, "27 s left"),
        (TIMED, 30.0, "Time is up"),
    ],
)
def test_last_ten_seconds_of_a_limit_are_counted_down(task: Any, elapsed_s: float, told: str) -> None:
    assert hint(task, elapsed_s) == told


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_language_says_that_time_is_up(language: str) -> None:
    assert hint(COUNTING, 60.0, language) == words(language).time_is_up
