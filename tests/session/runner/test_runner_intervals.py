"""Trials of intervals on the real servo and simulated devices, on a virtual clock: forces, rests, device buttons."""

from collections.abc import Iterator

import pytest

from study_app.devices.rig import Rig, open_rig, study_settings
from study_app.errors import SessionError
from study_app.haptics.runtime.clocks.clock import VirtualClock
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import stream
from study_app.session.device_buttons import ANSWERS
from study_app.session.transitions.events import Chosen, Continue, PauseRequested, ResumeRequested, Submitted, TaskDone
from study_app.session.transitions.state import Phase
from tests.compiled import needs_servo
from tests.protocol.trials.level_studies import study
from tests.session.runner.bench import Bench

pytestmark = [needs_servo, pytest.mark.slow]

FOLLOWED = (
    ('kind = "explore"\nmin_s = 1\nmax_s = 3', 'kind = "follow"\ncycles = 1\namplitude_mm = 15\nradius_mm = 5'),
    ('liquid = "thin"\n\n[conditions.other]', 'liquid = "thin"\nball = "hidden"\n\n[conditions.other]'),
)
PAIRS = '\n[designs.pairs]\nkind = "2ifc"\nfeedback = "always"\n'
STILL_N = 1e-9


def pairs(*edits: tuple[str, str]) -> Protocol:
    """Return the study of pairs with feedback, with edits of its text."""
    return study(('design = "2ifc"', 'design = "pairs"'), *edits, more=PAIRS)


@pytest.fixture(params=["scripted", "falcon-emulated"])
def rig(request: pytest.FixtureRequest) -> Iterator[Rig]:
    settings = study_settings(study(), stream(1, "hand"))
    with open_rig(request.param, settings, clock=VirtualClock()) as opened:
        yield opened


@pytest.fixture
def bench(rig: Rig) -> Bench:
    made = Bench(rig, pairs())
    made.swing()
    return made


def test_force_is_zero_in_rests_feedback_and_pauses_and_not_in_intervals(bench: Bench) -> None:
    assert bench.run(0.5).max() > 0.5
    bench.run_to(Phase.RESTING)
    bench.run(0.06)  # the force fades out
    assert bench.run(0.5).max() < STILL_N
    assert bench.state.phase is Phase.RESTING
    bench.run_to(Phase.TASK)
    assert bench.run(0.5).max() > 0.5
    bench.run_to(Phase.ANSWERING)
    bench.run(0.06)
    assert bench.run(0.3).max() < STILL_N
    bench.runner.post(Chosen(bench.clock(), bench.state.items[0], "first"))
    bench.runner.post(Submitted(bench.clock()))
    assert bench.state.phase is Phase.FEEDBACK
    assert bench.run(0.5).max() < STILL_N
    bench.run_to(Phase.TASK)
    bench.run(0.4)
    bench.runner.post(PauseRequested(bench.clock(), "participant"))
    bench.run(0.06)
    assert bench.run(0.5).max() < STILL_N
    assert bench.state.phase is Phase.PAUSED
    bench.runner.post(ResumeRequested(bench.clock(), "participant"))
    assert bench.run(0.5).max() > 0.5


def test_no_answer_no_task_event_and_no_button_ends_a_rest(bench: Bench) -> None:
    bench.run_to(Phase.RESTING)
    for event in (
        Chosen(bench.clock(), "choice_2ifc", "first"),
        Submitted(bench.clock()),
        TaskDone(bench.clock(), "complete", {}),
        Continue(bench.clock()),
    ):
        with pytest.raises(SessionError, match="while resting"):
            bench.runner.post(event)
    bench.hand.press(0b0111)
    bench.run(0.1)
    bench.hand.release()
    bench.run(0.06)
    assert bench.state.phase is Phase.RESTING
    assert bench.run(0.2).max() < STILL_N


@pytest.mark.parametrize("place", [0, 1])
def test_buttons_2_and_3_of_the_device_answer_where_there_are_two_answers(bench: Bench, place: int) -> None:
    bench.run_to(Phase.RESTING)
    bench.hand.press(ANSWERS[place])  # too early: held down since before the question it answers nothing
    bench.run_to(Phase.ANSWERING)
    bench.run(0.2)
    assert not bench.journal.of("choice")
    bench.hand.release()
    bench.run(0.1)
    bench.hand.press(ANSWERS[0] | ANSWERS[1])  # both at once are no answer
    bench.run(0.1)
    bench.hand.release()
    bench.run(0.1)
    bench.hand.press(ANSWERS[place])
    bench.run(0.1)
    assert [line["value"] for line in bench.journal.of("choice")] == [("first", "second")[place]]
    assert len(bench.journal.of("responses")) == 1
    assert bench.state.phase is Phase.FEEDBACK


def test_with_three_answers_no_button_of_the_device_answers(rig: Rig) -> None:
    bench = Bench(rig, pairs(('kind = "2ifc"', 'kind = "3ifc"')))
    bench.run_to(Phase.RESTING)
    bench.run_to(Phase.ANSWERING)
    for bit in ANSWERS:
        bench.hand.press(bit)
        bench.run(0.1)
        bench.hand.release()
        bench.run(0.1)
    assert bench.state.phase is Phase.ANSWERING
    assert not bench.journal.of("choice")


def test_a_rest_before_a_followed_target_lasts_until_the_ball_is_back_in_it(rig: Rig) -> None:
    bench = Bench(rig, pairs(*FOLLOWED))
    bench.hand.reach_to(0.02, 0.0, 0.0)
    bench.run_to(Phase.RESTING)
    assert bench.run(3.0)[60:].max() < STILL_N
    assert bench.state.phase is Phase.RESTING
    view = bench.runner.view(bench.servo.now_ns())
    assert view is not None
    assert (view.task.lit, view.task.target_m, view.ball_hidden) == (0, (0.0, 0.0, 0.0), False)
    assert view.position_m[0] == pytest.approx(0.02, abs=0.002)
    bench.hand.reach_to(0.0, 0.0, 0.0)
    bench.run(0.6)
    assert bench.state.phase is Phase.TASK


def test_a_rest_before_a_free_exploration_waits_for_no_place(bench: Bench) -> None:
    bench.run_to(Phase.RESTING)
    bench.hand.reach_to(0.04, 0.0, 0.0)
    bench.run(0.7)
    assert bench.state.phase is Phase.TASK
