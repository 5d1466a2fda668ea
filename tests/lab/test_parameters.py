"""The parameters of a liquid: every range can be set, and every value is stored under its name."""

from typing import Any

import pytest

from study_app.errors import StudyError
from study_app.haptics.model.effects.current import Channel
from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.estimators import Given
from study_app.haptics.model.scene import Liquid, Scene
from study_app.lab.parameters import parameter, sections, value_of, with_parameter
from study_app.protocol.load import load_scenes
from study_app.protocol.source.files import shipped

SCENES = {f"{file}/{name}": scene for file in shipped() for name, scene in load_scenes(file).items()}


def every(scene: Scene) -> list[Any]:
    return [it for section in sections(scene) for it in section.parameters]


@pytest.mark.variants(10)
@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_every_value_of_a_preset_can_be_set_again(name: str) -> None:
    scene = SCENES[name]
    for it in every(scene):
        value = value_of(scene, it.name)
        if value is None or it.name == "drag.law" or it.name.startswith(("effects", "motion.")):
            continue
        assert value_of(with_parameter(scene, it.name, value), it.name) == value
        assert with_parameter(scene, it.name, value) == scene, it.name


def test_a_number_out_of_range_is_refused_in_the_units_that_are_shown() -> None:
    with pytest.raises(StudyError, match=r"Breaking span must be from 0 mm to 500 mm, not 700 mm"):
        with_parameter(SCENES["rek2024/water"], "wake.breaking_span_m", 0.7)
    with pytest.raises(StudyError, match="Density must be a number, not nan"):
        with_parameter(SCENES["rek2024/water"], "liquid.density_kg_m3", float("nan"))
    with pytest.raises(StudyError, match="Density must be a number, not 'thick'"):
        with_parameter(SCENES["rek2024/water"], "liquid.density_kg_m3", "thick")


def test_a_preset_beyond_the_labs_range_widens_it() -> None:
    scene = with_parameter(SCENES["rek2024/water"], "wake.scaling", 1e5)
    liquid = scene.liquids[0]
    assert liquid.wake is not None
    wide = scene.model_copy(
        update={"liquids": (liquid.model_copy(update={"wake": liquid.wake.model_copy(update={"scaling": 1e7})}),)}
    )
    assert parameter(wide, "wake.scaling").most == 1e7
    assert parameter(wide, "liquid.density_kg_m3").default == 1000  # has no other: its own


def test_smoothing_left_open_follows_from_the_estimator() -> None:
    scene = SCENES["physical_liquids/glycerin"]
    kalman = with_parameter(scene, "velocity.kind", "kalman")
    for name, usual_s in (("added_mass.filter_s", 0.025), ("history.smoothing_s", 0.01)):
        assert value_of(scene, name) == usual_s
        assert value_of(kalman, name) == parameter(kalman, name).default == 0.015
        said = with_parameter(kalman, name, 0.02)
        assert (value_of(said, name), parameter(said, name).default) == (0.02, 0.015)


def test_another_current_or_region_begins_as_large_as_the_hand_reaches() -> None:
    scene = with_parameter(with_parameter(SCENES["rek2024/water"], "effects.current", "on"), "current.kind", "channel")
    assert scene.liquids[0].current == Channel(width_m=1.0, peak_mps=0.5)
    boxed = with_parameter(SCENES["rek2024/water"], "region.kind", "box")
    assert value_of(boxed, "region.size_m.y") == pytest.approx(1.0)
    assert value_of(with_parameter(boxed, "effects.surface", "on"), "effects.surface") == "on"


def test_effects_add_the_effects_that_they_require() -> None:
    scene = Scene(liquids=(Liquid(id="thin", density_kg_m3=1000.0, effects=()),))
    with_wake = with_parameter(scene, "effects.wake", "on")
    assert with_wake.liquids[0].effects == ("drag", "wake")
    local = with_parameter(with_wake, "effects.local_wake", "on")
    assert local.liquids[0].effects == ("drag", "local_wake")
    assert with_parameter(local, "effects.drag", "off").liquids[0].effects == ()


def test_effects_by_hand_begin_as_the_gate_chose_them() -> None:
    honey = SCENES["physical_liquids/honey"]
    by_hand = with_parameter(honey, "effects", "on").liquids[0]
    assert by_hand.effects == ("drag", "buoyancy", "added_mass", "history")
    assert by_hand.drag.law == "schiller-naumann"
    assert value_of(honey, "drag.law") == "schiller-naumann"
    lawful = with_parameter(honey, "drag.law", "brown-lawler")
    assert value_of(lawful, "drag.law") == "brown-lawler"
    assert value_of(lawful, "effects") == "on"
    assert with_parameter(honey, "effects.history", "off").liquids[0].effects == ("drag", "buoyancy", "added_mass")
    assert with_parameter(honey, "effects.non_newtonian", "on").liquids[0].viscosity_pa_s is None


def test_the_lab_refuses_several_liquids_and_a_given_velocity() -> None:
    water = SCENES["rek2024/water"]
    with pytest.raises(StudyError, match="one liquid at a time"):
        sections(Scene())
    with pytest.raises(StudyError, match="estimator"):
        sections(water.model_copy(update={"velocity": Given()}))


def test_a_linear_damper_has_its_damping_as_a_parameter() -> None:
    honey = SCENES["physical_liquids/honey"]
    assert "drag.damping_nspm" not in {it.name for section in sections(honey) for it in section.parameters}
    damper = with_parameter(honey, "drag.law", "linear")
    assert damper.liquids[0].drag == Drag(law="linear", damping_nspm=8)
    damping = parameter(damper, "drag.damping_nspm")
    assert (damping.least, damping.most, damping.unit) == (0.01, 200, "N·s/m")
    heavier = with_parameter(damper, "drag.damping_nspm", 20.0)
    assert value_of(heavier, "drag.damping_nspm") == 20
    assert with_parameter(heavier, "drag.law", "constant").liquids[0].drag == Drag()


def test_sections_hold_the_parameters_that_a_liquid_has_in_the_order_of_the_model() -> None:
    """Water names its effects, so that nothing selects them; those of honey are selected by accuracy and motion."""
    water, honey = (
        {section.title: [it.name for it in section.parameters] for section in sections(SCENES[name])}
        for name in ("rek2024/water", "physical_liquids/honey")
    )
    assert list(water) == ["Liquid", "Wake", "Body", "Filter", "Effects", "Region", "Hand"]
    assert list(honey) == [
        "Liquid", "Added mass", "History", "Body", "Filter", "Effects", "Accuracy", "Region", "Hand",
    ]  # fmt: skip
    assert water["Liquid"] == honey["Liquid"] == ["liquid.density_kg_m3", "liquid.viscosity_pa_s", "drag.law"]
    assert water["Filter"] == ["velocity.kind", "velocity.alpha", "knee.law", "knee.threshold_mps"]
    assert honey["Accuracy"] == [
        "accuracy.relative", "accuracy.absolute_n", "motion.speed_mps", "motion.acceleration_mps2",
    ]  # fmt: skip
    assert water["Effects"][:3] == ["effects", "effects.drag", "effects.wake"]
    assert (water["Region"], water["Hand"]) == (["region.kind"], ["scene.scale", "scene.force_limit_n"])
    with pytest.raises(StudyError, match=r"does not have the parameter 'history.window_s': select the effect to which"):
        parameter(SCENES["rek2024/water"], "history.window_s")


def test_a_single_component_of_a_vector_can_be_set() -> None:
    moved = SCENES["rek2024/water"].model_copy(update={"origin_m": (0.25, 0.5, -0.125)})
    cylinder = with_parameter(moved, "region.kind", "cylinder")
    region: Any = cylinder.liquids[0].region
    assert (region.centre_m, region.radius_m, region.height_m) == ((0.25, 0.5, -0.125), 0.5, 1.0)
    names = [it.name for it in every(cylinder) if it.name.startswith("region")]
    centre = [f"region.centre_m.{axis}" for axis in "xyz"]
    assert names == ["region.kind", *centre, "region.radius_m", "region.height_m"]
    changed = with_parameter(cylinder, "region.centre_m.y", 0.75)
    assert [value_of(changed, name) for name in centre] == [0.25, 0.75, -0.125]
    assert [parameter(changed, name).default for name in centre] == [0.0, 0.0, 0.0]
    assert [parameter(changed, name).label for name in centre] == ["Centre x", "Centre y", "Centre z"]
    box = with_parameter(moved, "region.kind", "box").liquids[0].region
    assert (box.centre_m, box.size_m) == ((0.25, 0.5, -0.125), (1.0, 1.0, 1.0))  # type: ignore[union-attr]


def test_the_ends_of_a_range_are_permitted_and_invalid_choices_are_named() -> None:
    water = SCENES["rek2024/water"]
    density = parameter(water, "liquid.density_kg_m3")
    assert (density.least, density.most, density.default) == (1.0, 25000.0, 1000.0)
    for value, kept in ((1.0, 1.0), (25000.0, 25000.0), (25000.0 + 1e-6, 25000.0)):
        assert value_of(with_parameter(water, "liquid.density_kg_m3", value), "liquid.density_kg_m3") == kept
    for value in (0.999, 25000.1):
        with pytest.raises(StudyError, match=r"^Density must be from 1 kg/m³ to 25000 kg/m³, not"):
            with_parameter(water, "liquid.density_kg_m3", value)
    with pytest.raises(StudyError, match=r"^Estimator must be one of 'ewma', 'raw', 'kalman', not 'median'$"):
        with_parameter(water, "velocity.kind", "median")
    with pytest.raises(StudyError, match=r"^Buoyancy must be one of 'off', 'on', not 'auto'$"):
        with_parameter(water, "effects.buoyancy", "auto")
    assert value_of(with_parameter(water, "effects", "auto"), "effects") == "auto"
    states = {name: value_of(water, f"effects.{name}") for name in ("drag", "wake", "history", "buoyancy")}
    assert states == {"drag": "on", "wake": "on", "history": "off", "buoyancy": "off"}
