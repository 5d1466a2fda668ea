import pytest
from pydantic import ValidationError

from study_app.errors import StudyError
from study_app.haptics.override import override, override_all
from study_app.haptics.scene import Body, Box, Everywhere, Given, Liquid, Scene, Wake
from tests.haptics.scenes import HONEY, LIGHT_OIL, WATER, liquid, scene


def test_defaults_are_those_of_the_thesis():
    empty = Scene()
    assert empty.body == Body(diameter_m=0.068, drag_coefficient=0.47, density_kg_m3=1000)
    assert (empty.scale, empty.rate_hz, empty.force_limit_n) == (10, 1000, 8)
    assert (empty.velocity.kind, empty.velocity.alpha) == ("ewma", 0.1)
    assert (empty.knee.law, empty.knee.threshold_mps) == ("sqrt", 5)
    wake = Wake(length=1700, scaling=1700)
    assert (wake.breaking_angle_deg, wake.breaking_span_m, wake.decay, wake.axes) == (45, 0.068, 0.999975, "xz")
    assert empty.liquids == ()


def test_a_scene_never_changes():
    with pytest.raises(ValidationError, match="frozen"):
        WATER.scale = 3


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"wake": {"length": 11, "scaling": 10}}, "the wake would outrun the body"),
        ({"effects": ("drag", "wake")}, "its table"),
        ({"effects": ("wake",), "wake": {"length": 1, "scaling": 1}}, "name both"),
        ({"effects": ("drag", "drag")}, "twice"),
        ({"effects": ("drag", "magnet")}, "'drag', 'wake', 'local_wake'"),
        ({"density_kg_m3": float("nan")}, "finite"),
        ({"density_kg_m3": 0}, "greater than 0"),
        ({"viscosity": 1}, "Extra inputs are not permitted"),
        ({"id": "a-b"}, "should match pattern"),
        ({"region": {"kind": "sphere"}}, "'everywhere', 'box', 'cylinder'"),
        ({"region": {"kind": "box", "size_m": (1, 0, 1)}}, "greater than 0"),
    ],
)
def test_a_liquid_that_makes_no_sense_is_refused_with_a_reason(fields, message):
    with pytest.raises(ValidationError, match=message):
        Liquid(**{"id": "x", "density_kg_m3": 1000, **fields})


def test_a_wake_as_long_as_its_scaling_is_allowed():
    assert Wake(length=10, scaling=10).length == 10


def test_liquids_need_ids_of_their_own_and_a_scene_takes_eight():
    with pytest.raises(ValidationError, match="share an id"):
        scene(liquid(id="a"), liquid(id="a"))
    with pytest.raises(ValidationError, match="at most 8"):
        scene(*(liquid(id=f"a{i}") for i in range(9)))


def test_tables_as_read_from_a_file_become_a_scene():
    read = Scene.model_validate(
        {
            "velocity": {"kind": "given"},
            "liquids": [
                {"id": "a", "density_kg_m3": 900, "region": {"kind": "box", "size_m": [1, 2, 3]}},
                {"id": "b", "density_kg_m3": 900},
            ],
        }
    )
    assert read.velocity == Given()
    assert read.liquids[0].region == Box(size_m=(1, 2, 3))
    assert read.liquids[1].region == Everywhere()


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
    ],
)
def test_override_sets_one_parameter_wherever_it_sits(name, text, where, value):
    changed = override(WATER, name, text)
    assert where(changed) == value
    assert where(WATER) != value
    assert override(WATER, name, where(WATER)) == WATER


def test_override_reaches_every_liquid_that_has_the_parameter():
    mixed = scene(*WATER.liquids, *HONEY.liquids, *LIGHT_OIL.liquids)
    changed = override(mixed, "decay", 0.9)
    assert [one.wake and one.wake.decay for one in changed.liquids] == [0.9, None, 0.9]


def test_parameters_that_belong_together_are_judged_together():
    with pytest.raises(StudyError, match="outrun"):
        override(WATER, "length", 5000)
    wake = override_all(WATER, {"length": "5000", "scaling": "5000"}).liquids[0].wake
    assert (wake.length, wake.scaling) == (5000, 5000)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("densty_kg_m3", 1, "no parameter 'densty_kg_m3': did you mean 'density_kg_m3'"),
        ("wake.alpha", 1, "no parameter 'wake.alpha': did you mean 'alpha'"),
        ("kind", "given", "no parameter 'kind'"),
        ("decay", 1.5, "cannot set decay = 1.5.*less than or equal to 1"),
        ("decay", "fast", "cannot set decay = fast.*valid number"),
    ],
)
def test_an_override_that_fails_says_why(name, value, message):
    with pytest.raises(StudyError, match=message):
        override(WATER, name, value)


def test_a_parameter_of_an_effect_left_out_is_unknown():
    with pytest.raises(StudyError, match=r"no parameter .length.*it has absolute_n, acceleration_mps2, alpha, "):
        override(HONEY, "length", 5)
