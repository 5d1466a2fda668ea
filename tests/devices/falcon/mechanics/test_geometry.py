import dataclasses
import math

import pytest

from study_app.devices.falcon.mechanics.geometry import (
    DEFAULT_GEOMETRY,
    GEOMETRIES,
    OUT_STROKE_M,
    SAFE_BOX_M,
    WORKSPACE_M,
    geometry_named,
)
from study_app.errors import DeviceError


def test_every_published_geometry_is_found_by_its_name():
    assert {geometry_named(name).name for name in GEOMETRIES} == {"libnifalcon", "zm-redux", "martin-hillier"}
    assert geometry_named(DEFAULT_GEOMETRY) is GEOMETRIES[DEFAULT_GEOMETRY]


def test_an_unknown_geometry_is_refused_with_the_known_ones():
    with pytest.raises(DeviceError, match=r"'stamper'.*libnifalcon, zm-redux, martin-hillier"):
        geometry_named("stamper")


@pytest.mark.parametrize(("name", "counts_per_degree"), [("libnifalcon", 27.45), ("martin-hillier", 27.09)])
def test_a_count_is_the_angle_that_was_published(name, counts_per_degree):
    assert 1 / math.degrees(GEOMETRIES[name].rad_per_count) == pytest.approx(counts_per_degree, abs=0.005)


@pytest.mark.parametrize("geometry", GEOMETRIES.values(), ids=str)
def test_arms_are_a_third_of_a_turn_apart_the_first_on_top(geometry):
    top, right, left = geometry.azimuths_rad
    assert math.sin(top) > 0.9
    assert math.cos(right) > 0.9
    assert math.cos(left) < -0.7
    assert top - right == pytest.approx(2 * math.pi / 3)
    assert right - left == pytest.approx(2 * math.pi / 3)


@pytest.mark.parametrize("geometry", GEOMETRIES.values(), ids=str)
def test_the_workspace_in_depth_lies_in_the_safe_box_and_before_the_out_stroke(geometry):
    nearest, farthest = geometry.centre_m - WORKSPACE_M[2], geometry.centre_m + WORKSPACE_M[2]
    assert SAFE_BOX_M[2][0] < nearest < farthest < SAFE_BOX_M[2][1] < OUT_STROKE_M


def test_geometries_cannot_be_changed():
    with pytest.raises(dataclasses.FrozenInstanceError):
        GEOMETRIES[DEFAULT_GEOMETRY].arm_m = 1.0
