"""Scene files follow the formats of studies: a damper belongs to format 2."""

from pathlib import Path

import pytest

from study_app.errors import ProtocolError
from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.gate import describe_gate, resolve
from study_app.haptics.model.overrides import override, value_of
from study_app.haptics.model.scene import Ewma, Kalman, Line, Liquid, Scene
from study_app.haptics.model.steady_state import steady
from study_app.protocol.load import load_scene
from study_app.protocol.scene_file import scene_text

DAMPER = '[liquids.damper]\ndrag = { law = "linear", damping_nspm = 12 }\n'


def written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def test_a_damper_in_format_2_needs_no_density(tmp_path: Path) -> None:
    scene = load_scene(written(tmp_path / "damper.toml", f"format = 2\n{DAMPER}"), "damper")
    assert scene.liquids[0].drag == Drag(law="linear", damping_nspm=12)
    assert value_of(override(scene, "damping_nspm", "20"), "damping_nspm") == 20
    assert steady(scene).force_n == pytest.approx(1.2)


@pytest.mark.parametrize(("number", "velocity"), [(1, Ewma()), (2, Kalman())])
def test_the_estimator_of_a_scene_file_is_that_of_its_format(
    tmp_path: Path, number: int, velocity: Ewma | Kalman
) -> None:
    text = f"format = {number}\n[scene]\nscale = 3\n[liquids.water]\ndensity_kg_m3 = 1000\n"
    assert load_scene(written(tmp_path / "water.toml", text), "water").velocity == velocity
    named = text.replace("scale = 3", 'scale = 3\nvelocity = { kind = "line" }')
    assert load_scene(written(tmp_path / "water.toml", named), "water").velocity == Line()


def test_a_damper_in_format_1_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ProtocolError, match='"linear" belongs to format 2') as refused:
        load_scene(written(tmp_path / "damper.toml", f"format = 1\n{DAMPER}density_kg_m3 = 1000\n"), "damper")
    assert "damping_nspm: belongs to format 2" in str(refused.value)


def test_the_density_counts_where_effects_are_chosen(tmp_path: Path) -> None:
    text = f'format = 2\n{DAMPER}effects = "auto"\n'
    with pytest.raises(ProtocolError, match="density_kg_m3: is missing"):
        load_scene(written(tmp_path / "damper.toml", text), "damper")
    scene = load_scene(written(tmp_path / "damper.toml", f"{text}density_kg_m3 = 1000\n"), "damper")
    assert resolve(scene).liquids[0].drag == Drag(law="linear", damping_nspm=12)
    assert "law linear, as the file says" in "\n".join(describe_gate(scene))


def test_only_a_scene_that_needs_it_is_written_in_format_2(tmp_path: Path) -> None:
    water = Scene(liquids=(Liquid(id="water", density_kg_m3=1000),))
    assert "format = 1\n" in scene_text(water)
    assert "damping_nspm" not in scene_text(water)
    damper = Scene(liquids=(Liquid(id="damper", density_kg_m3=1000, drag=Drag(law="linear", damping_nspm=3)),))
    read = load_scene(written(tmp_path / "damper.toml", scene_text(damper)), "damper")
    assert read == damper.model_copy(update={"format": 2})
    assert "format = 2\n" in scene_text(read)


UNSTEADY = '[liquids.honey]\ndensity_kg_m3 = 1420\nviscosity_pa_s = 10\neffects = ["unsteady_drag"]\n'


def test_unsteady_drag_belongs_to_format_2(tmp_path: Path) -> None:
    with pytest.raises(ProtocolError, match='"unsteady_drag" belongs to format 2'):
        load_scene(written(tmp_path / "honey.toml", UNSTEADY), "honey")
    honey = load_scene(written(tmp_path / "honey.toml", f"format = 2\n{UNSTEADY}"), "honey")
    assert honey.liquids[0].effects == ("unsteady_drag",)
    assert load_scene(written(tmp_path / "again.toml", scene_text(honey)), "honey") == honey


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (UNSTEADY.replace("viscosity_pa_s = 10\n", ""), "needs the liquid's viscosity_pa_s"),
        (UNSTEADY.replace('["uns', '["drag", "uns'), '"drag" and "unsteady_drag" are two models of the same thing'),
        (UNSTEADY.replace('["uns', '["history", "uns'), '"history" and "unsteady_drag" are two models'),
        (UNSTEADY.replace('["uns', '["added_mass", "uns'), '"added_mass" and "unsteady_drag" are two models'),
    ],
)
def test_what_unsteady_drag_cannot_do_is_said_in_a_line(wrong: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(ProtocolError, match=said) as refused:
        load_scene(written(tmp_path / "honey.toml", f"format = 2\n{wrong}"), "honey")
    assert len(refused.value.problems) == 1


def test_the_format_decides_what_auto_chooses_among(tmp_path: Path) -> None:
    text = UNSTEADY.replace('["unsteady_drag"]', '"auto"') + "[scene]\nscale = 3\n"
    chosen = {}
    for number in (1, 2):
        scene = load_scene(written(tmp_path / "honey.toml", f"format = {number}\n{text}"), "honey")
        assert load_scene(written(tmp_path / "again.toml", scene_text(scene)), "honey") == scene
        chosen[number] = resolve(scene).liquids[0].effects
    assert chosen == {1: ("drag", "buoyancy", "added_mass", "history"), 2: ("buoyancy", "unsteady_drag")}


def test_the_fade_belongs_to_format_2(tmp_path: Path) -> None:
    text = "[scene]\nfade_s = 0.3\n[liquids.water]\ndensity_kg_m3 = 1000\n"
    with pytest.raises(ProtocolError, match=r"scene\.fade_s: belongs to format 2"):
        load_scene(written(tmp_path / "water.toml", text), "water")
    scene = load_scene(written(tmp_path / "water.toml", f"format = 2\n{text}"), "water")
    assert scene.fade_s == 0.3
    assert load_scene(written(tmp_path / "again.toml", scene_text(scene)), "water") == scene
    assert "fade_s" not in scene_text(override(scene, "fade_s", 0.05))
