"""Available liquids, and presets that are read back as they were saved."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.haptics.model.estimators import Ewma, Kalman
from study_app.haptics.model.scene import Scene
from study_app.lab.ab_comparison import Setting
from study_app.lab.parameters import with_parameter
from study_app.lab.presets import Choice, available_liquids, preset_text, save_preset
from study_app.protocol.load import load_scene, load_scenes
from study_app.protocol.source.files import shipped

EDITS = (
    ("effects.current", "on"),
    ("current.kind", "channel"),
    ("region.kind", "cylinder"),
    ("effects.surface", "on"),
    ("effects.local_wake", "on"),
    ("velocity.kind", "raw"),
    ("liquid.density_kg_m3", 1234.5678901234567),
    ("liquid.viscosity_pa_s", 1e-5),
    ("effects.history", "on"),
    ("history.window_s", 0.1),
    ("effects.added_mass", "on"),
    ("effects", "auto"),
    ("motion.speed_mps", 1.5),
    ("knee.law", "none"),
)


def edited(scene: Scene) -> Scene:
    for name, value in EDITS:
        scene = with_parameter(scene, name, value)
    return scene


@pytest.mark.variants(7)
@pytest.mark.slow
@pytest.mark.parametrize("source", shipped())
@pytest.mark.parametrize("edit", [False, True])
def test_a_preset_reads_back_as_it_was_and_check_takes_it(source: str, edit: bool, tmp_path: Path) -> None:
    for name, origin in load_scenes(source).items():
        setting = Setting(name, origin, edited(origin) if edit else origin)
        path = tmp_path / f"{name}.toml"
        save_preset(path, preset_text(setting))
        assert load_scene(path, name) == setting.scene
        result = CliRunner().invoke(commands, ["check", str(path)])
        assert result.exit_code == 0, result.output


@pytest.mark.slow
def test_the_shipped_liquids_are_at_hand_with_those_of_a_folder_and_without_broken_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    origin, folder = load_scene("rek2024", "honey"), tmp_path / "protocols"
    folder.mkdir()
    for name in ("mine", "physical_liquids"):  # the second one replaces a shipped file
        save_preset(folder / f"{name}.toml", preset_text(Setting("Honey", origin, origin)))
    (folder / "broken.toml").write_text("format = ", encoding="utf-8", newline="\n")
    at_hand = available_liquids()
    assert Choice(source="rek2024", liquid="light_oil", title="Light oil (rek2024)") in at_hand
    assert Choice(source=str(folder / "mine.toml"), liquid="honey", title="Honey (mine)") in at_hand
    assert [it.liquid for it in at_hand if it.source == "physical_liquids"] == ["honey"]
    assert {it.source for it in at_hand} == {*shipped(), str(folder / "mine.toml")}
    assert len({it.title for it in at_hand}) == len(at_hand)
    water = next(it for it in at_hand if (it.source, it.liquid) == ("rek2024", "water"))
    assert water.scene.velocity == Ewma()  # as its file says
    assert water.setting().origin == water.scene.model_copy(update={"velocity": Kalman()})


def test_a_preset_states_its_origin_and_its_changes(tmp_path: Path) -> None:
    origin = load_scene("rek2024", "honey")
    changed = with_parameter(with_parameter(origin, "liquid.density_kg_m3", 1500.0), "velocity.kind", "raw")
    unchanged, text = (preset_text(Setting("Honey", origin, scene)) for scene in (origin, changed))
    assert "# Honey, as set in the liquid lab." in unchanged
    assert "Changed from the preset" not in unchanged
    assert "# Changed from the preset: liquid.density_kg_m3, velocity.kind." in text.splitlines()
    path = tmp_path / "own.toml"
    save_preset(path, text)
    saved = available_liquids((tmp_path / "none",), saved=(str(path), str(path)))
    assert [it for it in saved if it.source == str(path)] == [
        Choice(source=str(path), liquid="honey", title="Honey (own)")
    ]
    assert saved[-1].source == str(path), "after the shipped ones"
