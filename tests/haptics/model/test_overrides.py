from collections.abc import Iterator
from typing import Any

import pytest
from pydantic import BaseModel

from study_app.errors import StudyError
from study_app.haptics.model.effects.current import Channel, Uniform
from study_app.haptics.model.estimators import Kalman, Raw
from study_app.haptics.model.overrides import override_all, override_value
from study_app.haptics.model.scene import Box, Everywhere
from tests.haptics.scenes import HONEY, LIGHT_OIL, POOL, WATER, scene

FULL = scene(POOL)
OF_FULL = {"centre_m", "region", "depth_m", "velocity.kind", "velocity"}


def leaves(value: BaseModel, place: str) -> Iterator[tuple[str, str, Any]]:
    """Yield (table, field, value) of every parameter of a scene except its link; liquids are one table."""
    for field, value_of_field in value:
        if field == "link":
            continue
        if isinstance(value_of_field, BaseModel):
            yield from leaves(value_of_field, field)
        elif field == "liquids":
            for liquid in value_of_field:
                yield from leaves(liquid, "liquid")
        else:
            yield place, field, value_of_field


@pytest.mark.parametrize(
    ("name", "text", "where", "value"),
    [
        ("density_kg_m3", "1200", lambda s: s.liquids[0].density_kg_m3, 1200.0),
        ("length", "500", lambda s: s.liquids[0].wake.length, 500),
        ("exponent", "2", lambda s: s.liquids[0].wake.exponent, 2.0),
        ("axes", "xyz", lambda s: s.liquids[0].wake.axes, "xyz"),
        ("effects", "drag", lambda s: s.liquids[0].effects, ("drag",)),
        ("drag_coefficient", "0.5", lambda s: s.body.drag_coefficient, 0.5),
        ("body.density_kg_m3", "700", lambda s: s.body.density_kg_m3, 700.0),
        ("alpha", "0.2", lambda s: s.velocity.alpha, 0.2),
        ("law", "none", lambda s: s.knee.law, "none"),
        ("threshold_mps", "3", lambda s: s.knee.threshold_mps, 3.0),
        ("scale", "3", lambda s: s.scale, 3.0),
        ("origin_m", "0,0.5,0", lambda s: s.origin_m, (0.0, 0.5, 0.0)),
        ("centre_m", "1,2,3", lambda s: s.liquids[0].region.centre_m, (1, 2, 3)),
        ("region", '{kind="box", size_m=[1, 2, 3]}', lambda s: s.liquids[0].region, Box(size_m=(1, 2, 3))),
        ("depth_m", "-0.1,0.5", lambda s: s.motion.depth_m, (-0.1, 0.5)),
        ("effects", "auto", lambda s: s.liquids[0].effects, "auto"),
        ("velocity.kind", "raw", lambda s: s.velocity, Raw()),
        ("velocity", '{kind="kalman"}', lambda s: s.velocity, Kalman()),
    ],
)
def test_override_sets_one_parameter_wherever_it_sits(name, text, where, value):
    base_scene = FULL if name in OF_FULL else WATER
    assert where(override_value(base_scene, name, text)) == value
    assert where(base_scene) != value


@pytest.mark.parametrize(
    "base_scene",
    [
        FULL,
        FULL.model_copy(update={"velocity": Kalman()}),
        FULL.model_copy(update={"velocity": Raw()}),
        scene(POOL.model_copy(update={"current": Channel(width_m=1, peak_mps=1), "region": Box(size_m=(1, 2, 3))})),
        scene(POOL.model_copy(update={"current": Uniform(velocity_mps=(1, 2, 3))})),
    ],
)
def test_every_parameter_is_reached_with_its_table_and_most_by_name_only(base_scene):
    fields = [
        (table, field) for table, field, _ in leaves(base_scene, "scene") if field not in {"id", "kind", "without"}
    ]
    plain = []
    for table, field, value in leaves(base_scene, "scene"):
        if field in {"id", "without"}:
            continue
        text = ",".join(map(str, value)) if isinstance(value, tuple) else value
        if text is not None:
            assert override_value(base_scene, f"{table}.{field}", text) == base_scene
        if [name for _, name in fields].count(field) == 1 and text is not None:
            assert override_value(base_scene, field, text) == base_scene
            plain.append(field)
    shared = {field for _, field in fields} - set(plain)
    assert shared <= {
        *("density_kg_m3", "law", "centre_m", "viscosity_pa_s", "speed_mps", "acceleration_mps2", "depth_m", "reach_m"),
        *("length", "scaling", "exponent", "decay", "axes", "samples", "tolerance_m", "filter_s", "smoothing_s"),
        *("damping_nspm", "non_newtonian"),
    }


def test_tables_and_effects_are_judged_together():
    river = {"effects": "drag,current", "current": '{kind="channel", width_m=0.3, peak_mps=1}'}
    assert override_all(WATER, river).liquids[0].current == Channel(width_m=0.3, peak_mps=1)
    with pytest.raises(StudyError, match="its table"):
        override_value(WATER, "effects", "drag,current")
    with pytest.raises(StudyError, match="a region with a top"):
        override_all(FULL, {"region": '{kind="everywhere"}'})
    named = override_all(FULL, {"effects": "auto", "region": '{kind="everywhere"}'})
    assert override_value(named, "effects", "drag").liquids[0].region == Everywhere()
    assert override_value(named, "effects", "drag").liquids[0].effects == ("drag",)


def test_override_reaches_every_liquid_that_has_the_parameter():
    mixed = scene(*WATER.liquids, *HONEY.liquids, *LIGHT_OIL.liquids)
    changed = override_value(mixed, "decay", 0.9)
    assert [liquid.wake and liquid.wake.decay for liquid in changed.liquids] == [0.9, None, 0.9]


def test_parameters_that_belong_together_are_judged_together():
    with pytest.raises(StudyError, match="outrun"):
        override_value(WATER, "length", 5000)
    wake = override_all(WATER, {"length": "5000", "scaling": "5000"}).liquids[0].wake
    assert (wake.length, wake.scaling) == (5000, 5000)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("densty_kg_m3", 1, "the parameter 'densty_kg_m3': did you mean 'density_kg_m3'"),
        ("wake.alpha", 1, "the parameter 'wake.alpha': did you mean 'alpha'"),
        ("kind", "given", "the parameter 'kind'"),
        ("wake", "{length=1", "cannot read wake = {length=1: write a table such as"),
        ("liquids", "1", "the parameter 'liquids'"),
        ("decay", 1.5, "cannot set decay = 1.5.*less than or equal to 1"),
        ("decay", "fast", "cannot set decay = fast.*valid number"),
        ("drag", "1", "cannot set drag = 1: drag is a table of parameters: set one parameter by its name"),
    ],
)
def test_a_failed_override_states_its_reason(name, value, message):
    with pytest.raises(StudyError, match=message):
        override_value(WATER, name, value)
