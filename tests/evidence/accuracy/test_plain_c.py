"""The thesis' force in plain C is the servo's, and scenes that the C program cannot compute are refused."""

import shutil

import pytest

from study_app.errors import StudyError
from study_app.evidence.accuracy.plain_c import compare_with_plain_c
from study_app.haptics.model.scene import Raw
from study_app.protocol.load import load_scenes
from tests.evidence.accuracy.scenes import REAL, TANK, WATER, compiled

needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="there is no C compiler (gcc)")


def tank(**changes):
    wake = WATER.wake.model_copy(update=changes)
    return TANK.model_copy(update={"liquids": (WATER.model_copy(update={"wake": wake}),)})


@compiled
@needs_gcc
def test_plain_c_computes_the_forces_of_the_servo():
    scenes = load_scenes("rek2024") | {
        "vertical": tank(axes="xyz", exponent=1.5),
        "fading": tank(decay=0.99, breaking_angle_deg=10.0, breaking_span_m=0.0),
        "short": tank(length=1, scaling=2.5),
        "turning": tank(breaking_span_m=1.0),
    }
    for name, comparison in compare_with_plain_c(scenes, batches=5).items():
        assert comparison.difference < 1e-9, name
        assert 0 < comparison.plain_ns < comparison.tick_ns, name


@needs_gcc
@pytest.mark.parametrize(
    ("scene", "lacking"),
    [
        (TANK.model_copy(update={"velocity": Raw()}), "ewma"),
        (TANK.model_copy(update={"rate_hz": 500.0}), "1000 Hz"),
        (REAL, "constant coefficient"),
        (tank(resolution_m=0.01), "resolution 0"),
    ],
)
def test_a_scene_that_the_c_program_cannot_compute_is_refused(scene, lacking):
    with pytest.raises(StudyError, match=lacking):
        compare_with_plain_c({"water": scene}, batches=1)


def test_without_a_compiler_the_reason_is_named(monkeypatch):
    monkeypatch.setenv("PATH", "")
    with pytest.raises(StudyError, match=r"there is no C compiler \(gcc\)"):
        compare_with_plain_c({"water": TANK}, batches=1)
