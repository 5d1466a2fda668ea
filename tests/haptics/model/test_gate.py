"""Which effects a scene calls for: the rule, its worked examples, and the bounds by arithmetic."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.haptics.model.effects.current import Channel, Uniform, Vortex
from study_app.haptics.model.effects.drag import cheapest_law, resistance_n
from study_app.haptics.model.gate import Extremes, bounds, effect_verdicts, resolve, speed_after_knee_mps
from study_app.haptics.model.scene import Accuracy, Body, Box, Cylinder, Liquid, MotionBox, Scene

LIQUIDS = {
    "water": (998.2, 1.0016e-3),
    "olive_oil": (913, 0.084),
    "glycerin": (1261, 1.41),
    "honey": (1420, 10.0),
    "tar": (1150, 100.0),
}
VOLUME_M3 = math.pi * 0.068**3 / 6
STROKE_M = 0.04
HOLLOW = Body(density_kg_m3=0.01)


def stirred_scene(name, speed_mps, *, body=HOLLOW, **fields):
    """Return a scene of scale 1 in which a hand strokes ±4 cm at up to this speed; fields are the liquid's."""
    density, viscosity = LIQUIDS[name]
    liquid = Liquid(**{"id": name, "density_kg_m3": density, "viscosity_pa_s": viscosity, "effects": "auto", **fields})
    box = MotionBox(speed_mps=speed_mps, acceleration_mps2=speed_mps**2 / STROKE_M)
    return Scene(scale=1, body=body, motion=box, liquids=(liquid,))


def selected_effects(scene):
    """Return the names of the selected effects."""
    return [verdict.effect for verdict in effect_verdicts(scene) if verdict.included]


def bound(scene, effect):
    """Return one effect's bound [N]."""
    return bounds(scene, scene.liquids[0])[effect]


WITHOUT_UNSTEADY_DRAG = {"accuracy": Accuracy(without=("unsteady_drag",))}


@pytest.mark.parametrize(
    ("name", "speed_mps", "effects"),
    [
        ("water", 0.1, ["buoyancy"]),
        ("honey", 0.1, ["drag", "buoyancy", "history"]),
        ("tar", 0.1, ["drag", "buoyancy", "history"]),
        ("water", 1.0, ["drag", "buoyancy", "added_mass"]),
        ("olive_oil", 1.0, ["drag", "buoyancy", "added_mass", "history"]),
    ],
)
def test_worked_examples(name, speed_mps, effects):
    """A still pool, a slow hand and fast stirring; the sum rule includes history where a rule per effect would not."""
    assert selected_effects(stirred_scene(name, speed_mps).model_copy(update=WITHOUT_UNSTEADY_DRAG)) == effects


@pytest.mark.parametrize(
    ("name", "speed_mps", "drag_n", "added_mass_n", "history_n", "buoyancy_n"),
    [
        ("water", 0.5, 0.217, 0.51, 0.039, 1.61),
        ("water", 1.0, 0.89, 2.05, 0.11, 1.61),
        ("olive_oil", 0.5, 0.265, 0.47, 0.34, 1.47),
        ("glycerin", 0.5, 1.16, 0.65, 1.6, 2.04),
        ("honey", 0.25, 2.04, 0.18, 1.6, 2.29),
        ("honey", 0.5, 4.62, 0.73, 4.6, 2.29),
        ("tar", 0.1, 6.6, 0.024, 1.2, 1.86),
    ],
)
def test_bounds_equal_the_published_table(name, speed_mps, drag_n, added_mass_n, history_n, buoyancy_n):
    """The table's history is the amplitude of a sinusoid; the bound is the worst motion, √2 · 2/√π = 1.6 times that."""
    scene = stirred_scene(name, speed_mps)
    assert bound(scene, "drag") == pytest.approx(drag_n, rel=0.07)
    assert bound(scene, "added_mass") == pytest.approx(added_mass_n, rel=0.03)
    assert bound(scene, "history") == pytest.approx(history_n * 2 * math.sqrt(2 / math.pi), rel=0.05)
    assert bound(scene, "buoyancy") == pytest.approx(buoyancy_n, rel=0.01)


def test_a_current_is_bounded_by_its_drag_and_its_shear_by_its_inertia():
    still = stirred_scene("water", 0.5)
    uniform = stirred_scene("water", 0.5, current=Uniform(velocity_mps=(0.3, 0.0, 0.4)))
    liquid = uniform.liquids[0]
    assert bound(uniform, "current") == pytest.approx(
        resistance_n(uniform, liquid, 1.0) - resistance_n(uniform, liquid, 0.5)
    )
    assert bound(uniform, "added_mass") == bound(still, "added_mass")
    channel = stirred_scene("water", 0.5, current=Channel(width_m=0.2, peak_mps=-0.5))
    vortex = stirred_scene("water", 0.5, current=Vortex(core_m=0.1, peak_mps=0.5))
    sheared_mps2 = 0.5 * 4 * 0.5 / 0.2
    history_n = 12 * 0.034**2 * math.sqrt(2 * math.pi * 998.2 * 1.0016e-3 * sheared_mps2 * 0.5)
    assert bound(channel, "current") == pytest.approx(
        bound(uniform, "current") + 0.5 * 998.2 * VOLUME_M3 * sheared_mps2 + history_n
    )
    assert bound(channel, "added_mass") == pytest.approx(0.5 * 998.2 * VOLUME_M3 * (6.25 + sheared_mps2))
    assert bound(channel, "history") == pytest.approx(bound(still, "history") + history_n)
    assert all(bound(vortex, effect) == pytest.approx(bound(channel, effect)) for effect in ("current", "history"))


POOL = Box(size_m=(1.0, 0.4, 1.0))


@pytest.mark.parametrize(
    ("depth_m", "effects"),
    [((0.1, 0.3), set()), ((-0.05, 0.3), {"surface", "buoyancy"}), ((-0.5, -0.1), {"buoyancy"})],
    ids=["deep", "across", "above"],
)
def test_the_surface_is_called_for_where_the_ball_can_cross_it(depth_m, effects):
    scene = stirred_scene("water", 0.1, region=POOL, body=Body(density_kg_m3=998.2))
    scene = scene.model_copy(update={"motion": scene.motion.model_copy(update={"depth_m": depth_m})})
    assert set(selected_effects(scene)) == effects
    if effects == {"buoyancy"}:
        assert bound(scene, "drag") == bound(scene, "added_mass") == bound(scene, "surface") == 0.0
        assert bound(scene, "buoyancy") == pytest.approx(998.2 * VOLUME_M3 * 9.80665)


liquids = st.builds(
    Liquid,
    id=st.just("liquid"),
    density_kg_m3=st.floats(500, 5000),
    viscosity_pa_s=st.none() | st.floats(1e-4, 200),
    region=st.just(POOL) | st.builds(Cylinder, radius_m=st.just(0.3), height_m=st.floats(0.05, 1)),
    effects=st.just("auto"),
    current=st.none() | st.builds(Uniform, velocity_mps=st.tuples(*[st.floats(-1, 1)] * 3)),
)
scenes = st.builds(
    Scene,
    scale=st.sampled_from([1.0, 3.0, 10.0]),
    body=st.builds(Body, density_kg_m3=st.floats(1, 3000)),
    liquids=liquids.map(lambda liquid: (liquid,)),
    motion=st.builds(MotionBox, speed_mps=st.floats(0.01, 5), acceleration_mps2=st.floats(0.01, 50)),
    accuracy=st.builds(
        Accuracy,
        relative=st.floats(0, 0.5),
        absolute_n=st.floats(0, 1),
        without=st.just(("unsteady_drag",)),  # it replaces two of the others
    ),
)


@pytest.mark.slow
@given(scene=scenes)
def test_omitted_effects_fill_the_target_without_exceeding_it(scene):
    verdicts = effect_verdicts(scene)
    total_n = sum(verdict.bound_n for verdict in verdicts)
    small = [verdict.bound_n for verdict in verdicts if not verdict.included or "carries" in verdict.why]
    kept = [verdict.bound_n for verdict in verdicts if verdict.included and "carries" not in verdict.why]
    target_n = max(scene.accuracy.relative * min(total_n, scene.force_limit_n), scene.accuracy.absolute_n)
    assert sum(small) <= target_n * (1 + 1e-9)
    assert not kept or sum(small) + min(kept) > target_n * (1 - 1e-9)
    assert sum(verdict.share for verdict in verdicts) == pytest.approx(1.0)


@pytest.mark.slow
@given(scene=scenes)
def test_a_resolved_scene_is_valid_and_final(scene):
    named = resolve(scene)
    assert Scene.model_validate(named.model_dump()) == named
    assert list(named.liquids[0].effects) == selected_effects(scene) == selected_effects(named)
    assert resolve(named) is named


@pytest.mark.slow
@given(scene=scenes)
def test_the_law_is_the_cheapest_within_the_target_at_every_speed(scene):
    liquid = scene.liquids[0]
    law = cheapest_law(Extremes(scene, liquid))
    if liquid.viscosity_pa_s is None:
        assert law == "constant"
        return
    top_mps = speed_after_knee_mps(scene.motion.speed_mps, scene.knee) + math.hypot(
        *(liquid.current.velocity_mps if liquid.current else (0,))
    )

    def meets(law):
        return all(
            abs(resistance_n(scene, liquid, v, law) - true_n)
            <= max(scene.accuracy.relative * true_n, scene.accuracy.absolute_n) * (1 + 1e-9)
            for v in (top_mps * k / 60 for k in range(1, 61))
            for true_n in [resistance_n(scene, liquid, v)]
        )

    cheaper = {"constant": [], "schiller-naumann": ["constant"], "haider-levenspiel": ["constant", "schiller-naumann"]}
    assert meets(law)
    assert not any(meets(other) for other in cheaper[law])


@pytest.mark.parametrize(
    ("name", "speed_mps", "effects"),
    [
        ("honey", 0.1, ["buoyancy", "unsteady_drag"]),
        ("olive_oil", 1.0, ["buoyancy", "unsteady_drag"]),  # Re 739
        ("olive_oil", 1.4, ["drag", "buoyancy", "added_mass"]),  # Re 1035
        ("water", 1.0, ["drag", "buoyancy", "added_mass"]),
        ("water", 0.1, ["buoyancy"]),
    ],
)
def test_unsteady_drag_is_selected_up_to_re_1000(name, speed_mps, effects):
    assert selected_effects(stirred_scene(name, speed_mps)) == effects
