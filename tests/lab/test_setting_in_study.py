"""A setting of the lab used in a study: one table at the file's end, and every other byte as it was."""

import tomllib
from pathlib import Path

import pytest

from study_app.errors import StoreError
from study_app.lab.ab_comparison import Setting
from study_app.lab.parameters import changed
from study_app.lab.presets import Choice, preset_text, save, use_in_study
from study_app.protocol.load import load, load_scene
from study_app.protocol.source.files import source_bytes


@pytest.fixture
def setting() -> Setting:
    chosen = Choice("rek2024", "honey", "Honey").setting()
    scene = changed(changed(chosen.scene, "liquid.density_kg_m3", 1234.5), "body.drag_coefficient", 0.75)
    return Setting("Honey", chosen.scene, scene)


@pytest.fixture(params=["\n", "\r\n", ""])
def study(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """Return demo as a study of its own: with each kind of line end, and without the last one."""
    text = source_bytes("demo").replace(b"\n", b"\r\n") if request.param == "\r\n" else source_bytes("demo")
    path = tmp_path / "mine.toml"
    path.write_bytes(text if request.param else text.rstrip(b"\n"))
    return path


def test_a_saved_preset_is_named_at_the_end_and_felt_in_a_condition(study: Path, setting: Setting) -> None:
    before = study.read_bytes()
    preset = study.parent / "liquids" / "Gold syrup.toml"
    preset.parent.mkdir()
    save(preset, preset_text(setting))
    said = use_in_study(study, setting, preset)
    assert said.startswith("Added to mine.toml as [liquids.gold_syrup]. Name it in a condition.")
    assert "velocity filter" in said
    after = study.read_bytes()
    assert after.startswith(before)
    assert (b"\r\n[liquids.gold_syrup]\r\n" in after) == (b"\r\n" in before)
    assert tomllib.loads(after.decode())["liquids"]["gold_syrup"] == {"file": "liquids/Gold syrup.toml"}
    study.write_bytes(after.replace(b'liquid = "thick"', b'liquid = "gold_syrup"'))
    felt = load(study).scene_for("thick")
    assert (felt.liquids[0].density_kg_m3, felt.body.drag_coefficient) == (1234.5, 0.75)


def test_an_unsaved_setting_is_saved_beside_the_study_under_a_name_that_is_free(study: Path, setting: Setting) -> None:
    (study.parent / "honey.toml").write_text("# mine")
    use_in_study(study, setting, None)
    thinner = Setting("Honey", setting.origin, changed(setting.scene, "liquid.density_kg_m3", 1100.0))
    use_in_study(study, thinner, None)
    assert (study.parent / "honey.toml").read_text() == "# mine"
    liquids = tomllib.loads(study.read_text())["liquids"]
    assert liquids["honey"] == {"file": "honey-2.toml"}
    assert liquids["honey_2"] == {"file": "honey_2.toml"}
    assert load_scene(study.parent / "honey-2.toml", "honey") == setting.scene
    assert set(load(study).liquids) == {"thin", "thick", "honey", "honey_2"}


@pytest.mark.parametrize(
    "text",
    [
        b"format = 1\n[study",
        b"[liquids.a]\ndensity_kg_m3 = 1\n",
        b"liquids = {a = {density_kg_m3 = 1}}\n[study]\n",
        b"\xff",
    ],
)
def test_a_file_that_takes_no_table_is_refused_and_unchanged(tmp_path: Path, setting: Setting, text: bytes) -> None:
    path = tmp_path / "it.toml"
    path.write_bytes(text)
    before = path.read_bytes()
    with pytest.raises(StoreError, match=r"it\.toml"):
        use_in_study(path, setting, None)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]
