"""What a scene costs: which scenes are compared, and how it is told. No time is asserted."""

import itertools

import pytest

from study_app.evaluation import cost
from study_app.evaluation.cost import measure, report
from study_app.haptics.model.effects.current import Uniform
from study_app.haptics.model.effects.wake import Wake
from study_app.haptics.model.scene import Box, Liquid, Scene
from tests.haptics.scenes import COMPILED

pytestmark = pytest.mark.skipif(not COMPILED, reason="measures compiled code")

RIVER = Liquid(
    id="river",
    density_kg_m3=1000,
    viscosity_pa_s=1e-3,
    effects=("drag", "wake"),
    wake=Wake(length=100, scaling=100),
    current=Uniform(velocity_mps=(1, 0, 0)),
)
POOL = Liquid(id="pool", density_kg_m3=900, region=Box(size_m=(1, 1, 1)), effects="auto")
BOTH = Scene(scale=3, liquids=(RIVER, POOL))


class Clock:
    """Says how long each batch took, by the scene it was of: a stopwatch under the test's control."""

    def __init__(self, monkeypatch, cost_ns):
        self.now_ns = 0
        monkeypatch.setattr(cost.time, "perf_counter_ns", lambda: self.now_ns)

        def run(bench, ticks):
            self.now_ns += ticks * cost_ns(bench.scene)

        original = cost.Bench.__init__

        def begin(bench, scene):
            bench.scene = scene
            original(bench, scene)

        monkeypatch.setattr(cost.Bench, "__init__", begin)
        monkeypatch.setattr(cost.Bench, "run", run)


PRICES = {"drag": 2, "wake": 40, "current": 5, "buoyancy": 3, "surface": 7, "added_mass": 11, "history": 90}


def test_each_effect_costs_what_it_adds(monkeypatch):
    Clock(monkeypatch, lambda scene: 20 + sum(PRICES[it] for liquid in scene.liquids for it in liquid.effects))
    measured = measure(BOTH, batches=3)
    expected = {("river", name): PRICES[name] for name in PRICES if name != "surface"}
    expected |= {("pool", name): PRICES[name] for name in ("drag", "buoyancy", "surface", "added_mass")}
    assert measured.effects_ns == expected
    assert measured.rest_ns == 20
    chosen = ("drag", "buoyancy", "added_mass")  # the pool's surface is out of reach
    assert measured.scene_ns == 20 + 2 + 40 + sum(PRICES[it] for it in chosen)


def test_the_median_is_told_not_the_mean(monkeypatch):
    times = itertools.cycle([10, 10, 1000])
    Clock(monkeypatch, lambda scene: next(times))
    assert measure(Scene(), batches=9).rest_ns == 10


def test_a_report_has_the_gates_table_with_costs_and_the_whole(monkeypatch):
    Clock(monkeypatch, lambda scene: 20 + sum(PRICES[it] for liquid in scene.liquids for it in liquid.effects))
    lines = report(Scene(liquids=(RIVER,)), batches=1).splitlines()
    assert lines[0].startswith("river: effects named")
    assert [line.split()[3] for line in lines[2:4]] == ["2", "40"]
    assert lines[-1] == "one tick: 62 ns, 0.01 % of the tick period; 20 ns of it without liquids"
