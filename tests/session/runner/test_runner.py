"""The runner in a world of fakes: what it asks of whom, in which order, and what it makes of samples and buttons."""

from pathlib import Path

import numpy as np
import pytest

from study_app.session.device_buttons import ANSWERS, DeviceButtons
from study_app.session.transitions.events import Begin, PauseRequested
from study_app.session.transitions.state import Phase
from tests.golden import compare
from tests.session.fakes import World, step
from tests.session.runner.played_worlds import play
from tests.transcripts import every, played

FILES = every(Path(__file__).parent / "transcripts", "rows runner")


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_the_runner_asks_for_what_it_did(file: Path, pytestconfig: pytest.Config) -> None:
    compare(file, played(file, play), pytestconfig)


@pytest.mark.parametrize(("button", "way"), [(ANSWERS[0], -1), (ANSWERS[1], 1)])
def test_the_second_button_steps_to_less_and_the_third_to_more(world: World, button: int, way: int) -> None:
    buttons = DeviceButtons()

    def steps(*pressed: int, at_s: float) -> list[int]:
        samples = np.zeros(len(pressed), [("buttons", int), ("time_ns", int)])
        samples["buttons"], samples["time_ns"] = pressed, round(at_s * 1e9)
        return [event.steps for event in buttons.events(samples, 0, at_s, lambda: (world.state, True))]

    assert steps(0, button, at_s=1.0) == [way]
    assert steps(button, at_s=1.124) == []
    assert steps(button, at_s=1.126) == [way]
    assert steps(0, at_s=1.2) == steps(0, at_s=1.4) == []


def test_a_stall_of_the_program_is_noted_while_no_task_runs(world: World) -> None:
    world.runner.post(Begin(0.0))
    while world.state.phase is not Phase.TASK:
        step(world)
    for seconds in (0.1, 3.1):
        world.run(seconds)
    assert world.journal.of("note") == []
    world.runner.post(PauseRequested(world.clock(), "operator"))
    world.run(3.1)
    assert [line["text"] for line in world.journal.of("note")] == ["the program stalled for 3.1 s"]


def test_no_line_of_a_delayed_trial_names_condition_liquid_or_delay(world: World) -> None:
    world.runner.post(Begin(0.0))
    while not world.runner.finished:
        step(world)
    text = repr(world.journal.lines) + repr(world.pages) + repr(world.state)
    assert [word for word in ("is_late", "on_time", "is_thin", "is_thick", "0.137", "1013.7") if word in text] == []
    assert 137 not in [round(value) for line in world.journal.lines for value in line.values() if type(value) is float]
