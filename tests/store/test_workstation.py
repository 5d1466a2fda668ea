"""What this machine is like: kept whole, refused with one line where it makes no sense, and what follows from it."""

import json
import math
import os
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.errors import StoreError
from study_app.store.workstation import (
    ASIDE,
    DEFAULTS,
    LEAST_X_HEIGHT_DEG,
    STATEMENT_X_HEIGHT_PX,
    DeviceBench,
    DisplayOffset,
    MachineSettings,
    device_without_force,
    keep_workspace,
    load_or_default,
    load_settings,
    recent_protocols,
    remember_protocol,
    save_settings,
)
from study_app.workspace import Workspace, workspace

OFFSET = DisplayOffset(mean_ms=23.5, spread_ms=1.2, how="photodiode", measured="2026-11-20", screen="DP-1")
ALL = MachineSettings(
    screen="DP-1",
    screen_number=2,
    viewing_distance_mm=620,
    screen_width_mm=527.5,
    display_offset=OFFSET,
    device="falcon",
    firmware="/somewhere/firmware.bin",
    workspace="/somewhere",
    recent=("/somewhere/else.toml",),
    theme="dark",
    sound=True,
)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """No settings of this machine's user meet a test."""
    monkeypatch.setenv("LIQUID_STUDY_CONFIG", str(tmp_path / "settings"))
    return tmp_path / "settings"


def test_a_write_that_fails_leaves_the_old_settings(folder, monkeypatch):
    save_settings(ALL)
    assert load_settings() == ALL
    monkeypatch.setattr("study_app.store.files.atomic.os.fsync", _full)
    with pytest.raises(StoreError, match="machine"):
        save_settings(DEFAULTS)
    monkeypatch.undo()
    assert json.loads((folder / "machine.json").read_text("utf-8"))["screen"] == "DP-1"
    assert [path.name for path in folder.iterdir()] == ["machine.json"]


@pytest.mark.skipif(sys.platform != "linux", reason="paths are Unicode")
@pytest.mark.parametrize("name", ["workspace", "firmware"])
def test_a_path_that_is_not_utf_8_is_refused_in_one_line_and_the_settings_stay(folder, name):
    save_settings(ALL)
    with pytest.raises(StoreError, match=r"^'/x/donn.udce9es' is not UTF-8 text, .*: rename the folder$"):
        save_settings(ALL.model_copy(update={name: os.fsdecode(b"/x/donn\xe9es")}))
    assert load_settings() == ALL


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        *(
            (content, "it does not contain a table of settings")
            for content in ('["falcon", "dark"]', "[]", "620.5", '"falcon"', "null", "true")
        ),
        ("{", "it is not JSON (Expecting property name enclosed in double quotes: line 1 column 2 (char 1))"),
    ],
)
def test_a_file_without_a_table_of_settings_is_refused_by_name_and_the_defaults_are_used(folder, content, reason):
    folder.mkdir()
    file = folder / "machine.json"
    file.write_text(content, encoding="utf-8", newline="\n")
    message = (
        f"this machine's settings in {file} cannot be used: {reason}. Correct or delete the file, or set "
        "LIQUID_STUDY_CONFIG to another folder"
    )
    with pytest.raises(StoreError) as error:
        load_settings()
    assert str(error.value) == message
    assert load_or_default() == (DEFAULTS, message)
    assert device_without_force() == ""
    save_settings(ALL)
    assert load_or_default() == (ALL, "")
    assert (folder / ASIDE).read_text("utf-8") == content


def test_a_chosen_device_without_force_is_named():
    assert (DEFAULTS.device, device_without_force()) == ("mouse", "")
    names = {"spacemouse": "SpaceMouse", "falcon": "", "mouse": "Mouse", "spacemouse:left": "SpaceMouse"}
    for device, name in names.items():
        save_settings(ALL.model_copy(update={"device": device}))
        assert device_without_force() == name


def test_recent_protocols_are_those_that_still_exist_newest_first(tmp_path):
    files = [tmp_path / f"{name}.toml" for name in "abc"]
    for file in files:
        file.touch()
        remember_protocol(file)
    files[1].unlink()
    assert recent_protocols() == (str(files[2]), str(files[0]))


def test_only_the_newest_eight_protocols_outside_the_workspace_are_recent(tmp_path):
    inside = workspace().protocols / "inside.toml"
    for file in (*(tmp_path / f"{number}.toml" for number in (*range(10), 4)), inside):
        remember_protocol(file)
    assert [Path(name).stem for name in load_settings().recent] == ["4", "9", "8", "7", "6", "5", "3", "2"]


def test_a_measurement_replaces_only_that_of_the_same_device():
    zeros = dict.fromkeys(("mass_kg", "damping_nspm", "friction_n", "delay_ms", "stable_nspm"), (0.0, 0.0, 0.0))
    measurements = (
        ("falcon", "7", "Monday"),
        ("falcon", "8", "Tuesday"),
        ("mouse", "", "Friday"),
        ("falcon", "7", "Sunday"),
    )
    settings = DEFAULTS
    for name, serial, day in measurements:
        settings = settings.with_bench(DeviceBench(name=name, serial=serial, measured=day, **zeros))
    assert [bench.measured for bench in settings.benches] == ["Sunday", "Friday", "Tuesday"]
    devices = ({"name": "falcon", "serial": "8"}, {"name": "mouse", "serial": None}, {"name": "falcon"})
    assert [getattr(settings.bench_of(device), "measured", None) for device in devices] == ["Tuesday", "Friday", None]


def test_a_chosen_workspace_is_created_and_kept_with_the_other_settings(tmp_path):
    save_settings(ALL)
    keep_workspace(Workspace(tmp_path / "new"))
    assert load_settings() == ALL.model_copy(update={"workspace": str(tmp_path / "new")})
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["protocols", "results"]


def _full(_descriptor):
    raise OSError(28, "No space left on device")


@pytest.mark.slow
@given(distance=st.floats(200, 3000), width=st.floats(80, 5000), pixels=st.integers(1024, 7680))
def test_an_x_is_seen_under_four_tenths_of_a_degree_or_more(distance, width, pixels):
    settings = MachineSettings(viewing_distance_mm=distance, screen_width_mm=width)
    scale = settings.text_scale(pixels, 0.0)
    height_mm = scale * STATEMENT_X_HEIGHT_PX * width / pixels
    angle_degrees = math.degrees(2 * math.atan(height_mm / (2 * distance)))
    assert scale >= 1.0
    assert angle_degrees >= LEAST_X_HEIGHT_DEG * 0.9999  # a tangent of so small an angle is all but the angle
    if scale > 1:
        assert angle_degrees == pytest.approx(LEAST_X_HEIGHT_DEG, rel=1e-4)


def test_words_are_as_designed_until_the_distance_is_known():
    assert DEFAULTS.text_scale(1920, 527.0) == 1.0
    known = MachineSettings(viewing_distance_mm=600)
    assert known.text_scale(1920, 527.0) == pytest.approx(1.747, abs=0.001)  # by hand: 4.189 mm for 2.398 mm
    assert known.text_scale(1920, 0.0) == 1.0
    assert known.model_copy(update={"screen_width_mm": 1054.0}).text_scale(1920, 527.0) == 1.0


def test_the_receipt_gets_the_offset_only_for_the_measured_screen():
    there, elsewhere = ALL.describe("DP-1", 1920, 500.0), ALL.describe("HDMI-1", 1920, 500.0)
    assert there["display_offset"] == {"mean_ms": 23.5, "spread_ms": 1.2, "how": "photodiode", "measured": "2026-11-20"}
    assert elsewhere["display_offset"] is None
    assert (there["viewing_distance_mm"], there["width_mm"], there["width_measured"]) == (620, 527.5, True)
    assert (there["photodiode_patch"], there["text_scale"]) == (False, 1.804)  # by hand: 4.329 mm for 2.400 mm
    assert json.loads(json.dumps(there)) == there
    unmeasured = DEFAULTS.describe("DP-1", 1920, 500.04)
    assert (unmeasured["width_mm"], unmeasured["width_measured"], unmeasured["text_scale"]) == (500.0, False, 1.0)
