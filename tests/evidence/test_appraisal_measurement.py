"""Cost and accuracy of a scene, in this process and in the lab's worker process."""

import math
import re
from dataclasses import replace

import numba
import numpy as np
import pytest

from study_app.errors import StudyError
from study_app.evidence import appraisal_measurement, cost
from study_app.evidence.appraisal import Costs, DeliveryQuestion, Question, start_appraisal_worker
from study_app.evidence.appraisal_measurement import appraise, withheld_share
from study_app.evidence.cost import measure, report
from study_app.evidence.expected_error import acting_report, error_report, expected
from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics
from study_app.haptics.model.effects.current import Uniform
from study_app.haptics.model.effects.wake import Wake
from study_app.haptics.model.estimators import Given, Kalman
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Accuracy, Box, Liquid, MotionBox, Scene
from study_app.haptics.runtime.offline import samples_along
from study_app.protocol.load import load, load_scene, load_scenes
from study_app.protocol.trials.tasks import Explore, Reach, Stroke
from study_app.session.preflight import PredictedDelivery
from tests.compiled import needs_servo
from tests.haptics.materials import PRESETS, tank

if numba.config.DISABLE_JIT:
    pytest.skip("costs are those of compiled code", allow_module_level=True)

THESIS, PHYSICAL = load_scenes("rek2024"), load_scenes("physical_liquids")
SHAKE = Stroke(5.0, 0.03)
QUICK = Stroke(8.0, 0.03)


@pytest.mark.parametrize(
    ("unknown", "now", "known"),
    [
        (UNKNOWN, (0.11, 0.14), (0.0, 0.012)),  # EWMA in place of the Kalman filter
        (Dynamics(1e-3, assumed=("count_m",)), (0.0, 0.02), (0.0, 0.012)),
        (Dynamics(1e-3, 10e-6, assumed=("mass_kg",)), (0.0, 0.012), (0.0, 0.012)),
    ],
)
def test_the_velocity_is_worse_where_the_devices_numbers_are_unknown(
    unknown: Dynamics, now: tuple[float, float], known: tuple[float, float]
) -> None:
    scene = THESIS["honey"].model_copy(update={"velocity": Kalman()})
    errors = appraisal_measurement.velocity_errors(scene, unknown)
    assert now[0] < errors[0] < now[1]
    assert known[0] < errors[1] < known[1]
    assert (errors[0] > errors[1]) == (unknown.assumed != ("mass_kg",))


def test_an_error_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """A reference with one element less in its tail is another liquid."""
    true = appraisal_measurement.reference_model.respond

    def shorter(scene, motion):  # type: ignore[no-untyped-def]
        liquid = scene.liquids[0]
        wake = liquid.wake.model_copy(update={"length": liquid.wake.length - 1})
        other = scene.model_copy(update={"liquids": (liquid.model_copy(update={"wake": wake}),)})
        return true(other, motion)

    monkeypatch.setattr(appraisal_measurement.reference_model, "respond", shorter)
    errors = appraisal_measurement.errors(THESIS["light_oil"])
    assert errors.wake is not None
    assert errors.wake > 1e-4


def test_an_exploration_may_be_shaken_and_a_reach_goes_as_far_as_its_targets() -> None:
    tank_m = (0.1, 0.06, 0.06)
    assert Explore(kind="explore", min_s=1, max_s=3, instruction="Explore.").fastest_stroke(tank_m) == SHAKE
    assert Explore(kind="explore", min_s=1, max_s=3, instruction="Explore.").fastest_stroke((0.04, 0.06, 0.06)) == (
        5.0,
        0.02,
    )
    reach = load("rek2024").tasks["reach"]
    assert isinstance(reach, Reach)
    stroke = reach.fastest_stroke(tank_m)
    following = zip(reach.targets_m, (*reach.targets_m[1:], reach.targets_m[0]), strict=True)
    assert 2 * stroke.amplitude_m == pytest.approx(max(math.dist(*pair) for pair in following))
    assert stroke.frequency_hz == pytest.approx(1 / 0.6)


def test_the_withheld_share_depends_on_the_device_and_the_rate() -> None:
    scene = THESIS["light_oil"]
    usual = withheld_share(scene, QUICK, Dynamics(1e-3))
    light = withheld_share(scene, QUICK, Dynamics(1e-3, mass_kg=0.02))
    late = withheld_share(scene, QUICK, Dynamics(3e-3))
    slow = withheld_share(scene.model_copy(update={"rate_hz": 500.0}), QUICK, Dynamics(1e-3))
    assert len({usual, light, late, slow}) == 4
    t_s = np.arange(10) / 1000
    delays = samples_along(scene, Motion(t_s, np.zeros((10, 3))), Dynamics(2.5e-3)).delay_ticks
    assert set(delays) == {3}


@pytest.mark.slow
def test_the_process_answers_the_newest_question_and_ends_when_closed() -> None:
    worker = start_appraisal_worker()
    try:
        worker.order(Question(THESIS["honey"]))
        device = Dynamics(2e-3, mass_kg=0.05)
        newest = worker.order(Question(THESIS["light_oil"], QUICK, device))
        answered: dict[int, list[object]] = {}
        while len(answered.get(newest, [])) < 2:
            answers = worker.answers(wait_s=120.0)  # the first time it compiles
            assert answers
            for number, answer in answers:
                answered.setdefault(number, []).append(answer)
        assert answered[1][-1] is None, "it was given up for the newer one"
        first, second = answered[newest]
        assert isinstance(first, Costs)
        assert [it.effect for it in first.effects if it.ns is not None] == ["drag", "wake"]
        share = withheld_share(THESIS["light_oil"], QUICK, device)
        assert share != withheld_share(THESIS["light_oil"], QUICK, UNKNOWN)
        assert second == replace(appraisal_measurement.errors(THESIS["light_oil"]), withheld=share)
        assert worker.works
    finally:
        worker.close()
    assert not worker.works
    worker.wait_until_ended()
    assert worker.ended
    worker.order(Question(THESIS["honey"]))
    assert worker.answers() == []


def test_an_unstable_scene_is_refused() -> None:
    wild = THESIS["water"].model_copy(update={"rate_hz": 100.0})  # slower than any loop that is known to be stable
    answers: list[object] = []
    with pytest.raises(StudyError, match="no force has been shown to be stable"):
        appraise(Question(wild), answers.append, lambda: False)
    assert answers == []


STROKES = MotionBox(speed_mps=0.6, acceleration_mps2=6)


@pytest.mark.nightly
@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.slow
def test_non_newtonian_liquids_are_compared_with_their_law_added_mass_and_buoyancy(name):
    whole = tank(name, scale=3.0, effects=("non_newtonian", "added_mass", "buoyancy"), motion=STROKES)
    expected_error = expected(whole)
    assert expected_error.causes.law < 0.05
    assert 0.03 < expected_error.error_share < 0.2 + expected_error.causes.limits
    known = expected(whole.model_copy(update={"velocity": Given()}))
    assert known.error_share < 0.05 + known.causes.limits
    lacking = expected(tank(name, scale=3.0, motion=STROKES))
    assert lacking.causes.law > expected_error.causes.law + 0.02
    assert f"{PRESETS[name][1].kind} law (no reference in unsteady flow)" in error_report(whole)


@pytest.mark.slow
def test_the_scene_report_states_the_acting_share_of_each_part_and_offers_kalman():
    own, offered = acting_report(load_scene("rek2024", "water")).splitlines()
    pattern = (
        r"with 2 ticks of delay, the hand receives \d+ % of the drag and (\d+) % of the wake \(error [\d.]+ %\); "
        r"with 3 ticks of delay, .* % of the wake \(error"
    )
    assert own.startswith("delivered force of water (hand: medium grip, 0.2 kg, 1.6 Hz ±20 mm; estimator ewma): ")
    assert offered.startswith('  with velocity = { kind = "kalman" }: ')
    assert int(re.search(pattern, own)[1]) < 20
    assert int(re.search(pattern, offered)[1]) > 70
    assert "of the inertia (error" in acting_report(load_scene("physical2", "honey"))
    assert acting_report(Scene()) == ""


RIVER = Liquid(
    id="river",
    density_kg_m3=1000,
    viscosity_pa_s=1e-3,
    effects=("drag", "wake"),
    wake=Wake(length=100, scaling=100),
    current=Uniform(velocity_mps=(1, 0, 0)),
)
POOL = Liquid(id="pool", density_kg_m3=900, region=Box(size_m=(1, 1, 1)), effects="auto")
STEADY = Accuracy(without=("unsteady_drag",))
BOTH = Scene(accuracy=STEADY, scale=3, liquids=(RIVER, POOL))


class Clock:
    """A stopwatch under the test's control: the time of each batch follows from its scene."""

    def __init__(self, monkeypatch, cost_ns):
        self.now_ns = 0
        monkeypatch.setattr(cost.time, "perf_counter_ns", lambda: self.now_ns)

        def run(bench, ticks):
            self.now_ns += ticks * cost_ns(bench.scene)

        original = cost.TickTimer.__init__

        def begin(bench, scene):
            bench.scene = scene
            original(bench, scene)

        monkeypatch.setattr(cost.TickTimer, "__init__", begin)
        monkeypatch.setattr(cost.TickTimer, "run", run)


PRICES = {"drag": 2, "wake": 40, "current": 5, "buoyancy": 3, "surface": 7, "added_mass": 11, "history": 90}


def test_the_cost_of_each_effect_is_its_added_time(monkeypatch):
    Clock(monkeypatch, lambda scene: 20 + sum(PRICES[it] for liquid in scene.liquids for it in liquid.effects))
    measured = measure(BOTH, batches=3)
    expected = {("river", name): PRICES[name] for name in PRICES if name != "surface"}
    expected |= {("pool", name): PRICES[name] for name in ("drag", "buoyancy", "surface", "added_mass")}
    assert measured.effects_ns == expected
    assert measured.rest_ns == 20
    chosen = ("drag", "buoyancy", "added_mass")  # the pool's surface is out of reach
    assert measured.scene_ns == 20 + 2 + 40 + sum(PRICES[it] for it in chosen)


def test_a_report_has_the_gates_table_with_costs_and_the_whole(monkeypatch):
    Clock(monkeypatch, lambda scene: 20 + sum(PRICES[it] for liquid in scene.liquids for it in liquid.effects))
    lines = report(Scene(accuracy=STEADY, liquids=(RIVER,)), batches=1).splitlines()
    assert lines[0].startswith("river: effects listed in the file")
    assert [line.split()[3] for line in lines[2:4]] == ["2", "40"]
    assert lines[-1] == "one tick: 62 ns, 0.01 % of the tick period; without liquids, 20 ns"


@needs_servo
@pytest.mark.slow
def test_the_worker_predicts_the_trials_out_of_limits_on_a_slow_device() -> None:
    """On a loop of two ticks half the force of slime is withheld, which is one of the study's five liquids."""
    sent: list[object] = []
    prediction = appraise(DeliveryQuestion(load("slime"), 2), sent.append, lambda: False)
    assert isinstance(prediction, PredictedDelivery)
    assert (prediction.missing, prediction.asked, prediction.judged, prediction.limit_percent) == (0, 0, 5, 25)
    assert prediction.out >= 1
    at_one_tick = appraise(DeliveryQuestion(load("slime"), 1), sent.append, lambda: False)
    assert isinstance(at_one_tick, PredictedDelivery)
    assert at_one_tick.out == 0
    assert sent == []
