"""The protocols that ship: the thesis' study exactly, and a demonstration of three minutes."""

import shutil
import subprocess
from pathlib import Path

import pytest

from study_app.gui.home.study_facts import is_shipped
from study_app.haptics.model.estimators import Ewma, Kalman
from study_app.haptics.model.gate import resolve
from study_app.protocol.load import load, load_scene, load_scenes
from study_app.protocol.orders.block_orders import orders_of
from study_app.protocol.orders.schedule import FormStep, Trial, build_schedule
from study_app.protocol.source import files
from study_app.protocol.source.files import known_protocols, shipped

PROTOCOLS = Path(__file__).parents[2] / "protocols"
NAMES = sorted(path.stem for path in PROTOCOLS.glob("*.toml"))


def test_shipped_studies_are_the_tracked_files():
    tracked = subprocess.run(["git", "ls-files", "*.toml"], cwd=PROTOCOLS, capture_output=True, text=True, check=False)
    assert tuple(shipped()) == tuple(sorted(Path(name).stem for name in tracked.stdout.split()) or NAMES)


def test_a_study_made_in_a_checkout_does_not_ship(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "study_app").mkdir()
    shutil.copytree(PROTOCOLS, tmp_path / "protocols")
    text = (PROTOCOLS / "demo.toml").read_text(encoding="utf-8")
    (tmp_path / "protocols" / "mine.toml").write_text(text.replace('"demo"', '"mine"'), encoding="utf-8", newline="\n")
    monkeypatch.setattr(files, "_PACKAGE", tmp_path / "study_app")
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    assert is_shipped("demo")
    assert not is_shipped("mine")
    assert [name for name in known_protocols() if name == "mine"] == ["mine"]


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_study_is_sound_and_named_like_its_file(name: str):
    protocol = load(PROTOCOLS / f"{name}.toml")
    assert protocol.study.name == name.replace("_", "")
    steps = build_schedule(protocol, "P001", 1).steps
    analysed = [
        step for step in steps if isinstance(step, FormStep) or (isinstance(step, Trial) and step.phase == "main")
    ]
    assert orders_of(protocol).answers == sum(len(step.items) for step in analysed)


PHYSICAL = load("physical_liquids")


def test_the_second_edition_of_the_physical_liquids_differs_in_estimator_and_chosen_effects():
    first, second = (load(name) for name in ("physical_liquids", "physical2"))
    assert (first.liquids, first.conditions) == (second.liquids, second.conditions)
    assert (first.scene.velocity, second.scene.velocity) == (Ewma(), Kalman())
    assert first.scene.model_copy(update={"velocity": Kalman(), "accuracy": second.scene.accuracy}) == second.scene
    assert (first.scene.accuracy.without, second.scene.accuracy.without) == (("unsteady_drag",), ())
    effects_of = {name: resolve(second.scene_of(name)).liquids[0].effects for name in second.liquids}
    assert effects_of.pop("water") == ("drag", "added_mass")
    assert all("unsteady_drag" in effects and "drag" not in effects for effects in effects_of.values())
    assert not any("unsteady_drag" in resolve(first.scene_of(name)).liquids[0].effects for name in first.liquids)


def test_the_scene_of_a_liquid_has_all_that_the_file_says():
    scenes = load_scenes("physical_liquids")
    assert list(scenes) == list(PHYSICAL.liquids)
    assert scenes["tar"] == load_scene("physical_liquids", "tar") == PHYSICAL.scene_of("tar")
    assert scenes["honey"] == PHYSICAL.scene_for("honey")
    assert (scenes["honey"].motion.speed_mps, scenes["honey"].accuracy.relative) == (0.6, 0.05)
    assert scenes["honey"].force_limit_n == 8


def test_a_scene_file_may_say_auto_and_give_its_motion(tmp_path):
    file = tmp_path / "oil.toml"
    file.write_text(
        "format = 2\n[scene]\nscale = 2\nmotion = { speed_mps = 1, depth_m = [-0.1, 0.2] }\n"
        "accuracy = { relative = 0.1 }\n"
        '[liquids.oil]\ndensity_kg_m3 = 900\nviscosity_pa_s = 0.1\neffects = "auto"\n'
        'region = { kind = "box", size_m = [1, 1, 1] }\n',
        encoding="utf-8",
        newline="\n",
    )
    scene = load_scene(file, "oil")
    assert scene.motion_in(scene.liquids[0]).depth_m == (-0.1, 0.2)
    assert scene.accuracy.relative == 0.1
