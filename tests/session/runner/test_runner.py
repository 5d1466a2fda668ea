"""The runner in a world of fakes: what it asks of whom, in which order, and what it makes of samples and buttons."""

from pathlib import Path

import pytest

from study_app.session.transitions.events import Begin
from tests.golden import compare
from tests.session.fakes import World, step
from tests.session.runner.played_worlds import play
from tests.transcripts import every, played

FILES = every(Path(__file__).parent / "transcripts", "rows runner")


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_the_runner_asks_for_what_it_did(file: Path, pytestconfig: pytest.Config) -> None:
    compare(file, played(file, play), pytestconfig)


def test_no_line_of_a_delayed_trial_names_condition_liquid_or_delay(world: World) -> None:
    world.runner.post(Begin(0.0))
    while not world.runner.finished:
        step(world)
    text = repr(world.journal.lines) + repr(world.pages) + repr(world.state)
    assert [word for word in ("is_late", "on_time", "is_thin", "is_thick", "0.137", "1013.7") if word in text] == []
    assert 137 not in [round(value) for line in world.journal.lines for value in line.values() if type(value) is float]
