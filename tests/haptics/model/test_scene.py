import pytest
from pydantic import ValidationError

from study_app.haptics.model.effects import drag
from study_app.haptics.model.scene import Liquid, MotionBox, Scene
from study_app.haptics.runtime.pack import pack
from tests.haptics.scenes import liquid, scene

SHORT = {"length": 1, "scaling": 1}


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"wake": {"length": 11, "scaling": 10}}, "the wake would outrun the body"),
        ({"effects": ("drag", "wake")}, "its table"),
        ({"effects": ("wake",), "wake": {"length": 1, "scaling": 1}}, "list both"),
        ({"effects": ("drag", "drag")}, "twice"),
        ({"effects": ("drag", "magnet")}, "'drag', 'wake', 'local_wake'"),
        ({"density_kg_m3": float("nan")}, "finite"),
        ({"density_kg_m3": 0}, "greater than or equal to 0.01"),
        ({"viscosity": 1}, "Extra inputs are not permitted"),
        ({"effects": ("drag", "local_wake")}, "its table"),
        ({"effects": ("drag", "current")}, 'kind = "uniform", "channel" or "vortex"'),
        ({"effects": ("current",), "current": {"kind": "vortex", "core_m": 1, "peak_mps": 1}}, "list both"),
        ({"effects": ("drag", "wake", "local_wake"), "wake": SHORT, "local_wake": SHORT}, "two models of the same"),
        ({"local_wake": {"length": 11, "scaling": 10}}, "the wake would outrun the body"),
        ({"drag": {"law": "brown-lawler"}}, "needs the liquid's viscosity_pa_s"),
        ({"effects": ("history",)}, "needs the liquid's viscosity_pa_s"),
        ({"effects": ("surface",)}, "needs a region with a top"),
        ({"effects": "automatic"}, "'auto'"),
        ({"id": "a-b"}, "should match pattern"),
        ({"region": {"kind": "sphere"}}, "'everywhere', 'box', 'cylinder'"),
        ({"region": {"kind": "box", "size_m": (1, 0, 1)}}, "greater than or equal to 0.001"),
    ],
)
def test_a_liquid_that_makes_no_sense_is_refused_with_a_reason(fields, message):
    with pytest.raises(ValidationError, match=message):
        Liquid(**{"id": "x", "density_kg_m3": 1000, **fields})


def test_a_liquid_may_leave_the_choice_to_the_gate():
    left = Liquid(id="x", density_kg_m3=1000, viscosity_pa_s=1e-3, effects="auto")
    assert left.effects == "auto"
    assert pack(Scene(liquids=(left,))).liquids[0].effects & drag.BIT


@pytest.mark.parametrize(
    ("region", "depth_m"),
    [
        ({"kind": "everywhere"}, None),
        ({"kind": "box", "centre_m": (0, 0.1, 0), "size_m": (1, 1, 1)}, (0.6 - 0.12 - 0.3, 0.6 + 0.12 - 0.3)),
        ({"kind": "cylinder", "radius_m": 1, "height_m": 1}, (0.5 - 0.12 - 0.3, 0.5 + 0.12 - 0.3)),
    ],
)
def test_the_motion_box_follows_from_the_hand_unless_stated(region, depth_m):
    medium = liquid(region=region)
    liquid_scene = scene(medium, scale=3, origin_m=(0, 0.3, 0))
    motion = liquid_scene.motion_in(medium)
    assert (motion.speed_mps, motion.acceleration_mps2) == pytest.approx((0.9, 9.0))
    assert motion.depth_m == (None if depth_m is None else pytest.approx(depth_m))
    stated = MotionBox(speed_mps=1, acceleration_mps2=2, depth_m=(-1, 3))
    assert liquid_scene.model_copy(update={"motion": stated}).motion_in(medium) == stated


def test_liquids_need_ids_of_their_own_and_a_scene_takes_eight():
    with pytest.raises(ValidationError, match="share an ID"):
        scene(liquid(id="a"), liquid(id="a"))
    with pytest.raises(ValidationError, match="at most 8"):
        scene(*(liquid(id=f"a{i}") for i in range(9)))
