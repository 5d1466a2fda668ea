"""Which files a study names as its liquids, however the key is written."""

import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.errors import Problem, ProtocolError
from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.estimators import Kalman, Raw
from study_app.haptics.model.gate import describe_gate, resolve
from study_app.haptics.model.overrides import override_value, value_of
from study_app.haptics.model.scene import Liquid, Scene
from study_app.haptics.model.slope_limits import steady_force
from study_app.protocol.descriptions.protocol_text import describe
from study_app.protocol.file_format.scene_file import scene_text
from study_app.protocol.load import load, load_scene, parse
from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.source.files import StudySource, source_bytes
from tests.platforms import needs_posix
from tests.protocol.sound import EVERY_ORDER, SOUND


def test_a_name_is_looked_up_in_the_working_folder_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    assert load("rek2024").study.name == "rek2024"
    own = tmp_path / "protocols" / "rek2024.toml"
    own.parent.mkdir()
    own.write_text(SOUND, encoding="utf-8", newline="\n")
    assert load("rek2024").study.name == "small"
    assert source_bytes("rek2024") == SOUND.encode()
    assert load(own).study.name == load(str(own)).study.name == "small"


@pytest.mark.parametrize(
    ("name", "message", "hint"),
    [
        ("rek2042", "there is no protocol with this name", 'did you mean "rek2024"?'),
        ("elsewhere", "there is no protocol with this name", "known: delaydetect, "),
        ("folder/rek2024.toml", "there is no such file", "specify a file, or one of these names: delaydetect, "),
        ("rek2024.toml", "there is no such file", "specify a file, or one of these names: delaydetect, "),
        (".", "is a folder, not a protocol file", "specify one of the .toml files in it"),
        pytest.param(
            "/dev/null", "is a pipe or a device, not a protocol file", "specify a .toml file", marks=needs_posix
        ),
    ],
)
def test_a_missing_protocol_is_refused_with_a_hint(
    name: str, message: str, hint: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ProtocolError) as error:
        load(name)
    assert str(error.value).startswith(f"{name}: 1 problem\n  file: {message} ({hint}")
    (problem,) = error.value.problems
    assert (problem.place, problem.message, problem.hint[: len(hint)]) == ("file", message, hint)


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = tmp_path / "secret.toml"
    path.write_text(SOUND, encoding="utf-8", newline="\n")

    def refuse(_: Path) -> bytes:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "read_bytes", refuse)
    with pytest.raises(ProtocolError) as error:
        load(path)
    assert error.value.problems == (Problem("file", "cannot be read: Permission denied", hint="check its permissions"),)


def test_a_scene_is_one_liquid_of_a_protocol():
    scene = load_scene("rek2024", "honey")
    assert [liquid.id for liquid in scene.liquids] == ["honey"]
    assert (scene.scale, scene.rate_hz, scene.force_limit_n) == (10, 1000, 8)
    assert scene == load("rek2024").scene_for("honey")


def test_a_scene_file_is_loaded_without_a_study(tmp_path: Path):
    path = tmp_path / "scene.toml"
    path.write_text(
        "format = 2\n[scene]\nscale = 3\nrate_hz = 500\n[liquids.tar]\ndensity_kg_m3 = 1153\n",
        encoding="utf-8",
        newline="\n",
    )
    scene = load_scene(path, "tar")
    assert (scene.scale, scene.rate_hz, scene.liquids[0].density_kg_m3) == (3, 500, 1153)
    path.write_text("format = 2\n[liquids.tar]\ndensity_kg_m3 = 1153\n", encoding="utf-8", newline="\n")
    assert load_scene(path, "tar").scale == 10


def test_problems_of_a_scene_file_are_its_own(tmp_path: Path):
    path = tmp_path / "scene.toml"
    path.write_text("format = 2\n[scene]\nscael = 3\n\n[liquids.tar]\ndensity = 1153\n", encoding="utf-8", newline="\n")
    with pytest.raises(ProtocolError) as error:
        load_scene(path, "tar")
    assert [(problem.line, problem.place) for problem in error.value.problems] == [
        (3, "scene.scael"),
        (5, "liquids.tar.density_kg_m3"),
        (6, "liquids.tar.density"),
    ]


def test_an_unknown_liquid_is_named_with_the_nearest():
    with pytest.raises(ProtocolError, match='there is no liquid "hony"') as error:
        load_scene("rek2024", "hony")
    assert 'did you mean "honey"?' in str(error.value)


LINES = EVERY_ORDER.splitlines()
VALUES = ["3", "-1.5", "true", '""', '"thin"', "[]", "[1, [2]]", "{}", "{ en = 1 }", '["thin"]', "1979-05-27", "inf"]


@pytest.mark.slow
@given(
    st.lists(
        st.tuples(st.integers(0, len(LINES) - 1), st.sampled_from(["drop", "double", *VALUES])), min_size=1, max_size=5
    )
)
def test_any_change_gives_a_protocol_or_a_list_of_problems(changes: list[tuple[int, str]]):
    lines = list(LINES)
    for number, change in changes:
        if change == "drop":
            lines[number] = ""
        elif change == "double":
            lines[number] += "\n" + lines[number]
        elif " = " in lines[number]:
            lines[number] = lines[number].split(" = ")[0] + " = " + change
    problems: tuple[Problem, ...] = ()
    try:
        protocol = parse("\n".join(lines).encode(), "file.toml")
    except ProtocolError as error:
        problems = error.problems
    else:
        assert build_schedule(protocol, "P1", 1).trials
        assert describe(protocol)
    assert all(problem.message and problem.place for problem in problems)


@pytest.mark.parametrize(
    "text",
    [
        '[liquids.thick]\nfile = "a.toml"\n',
        '[liquids.thick]\nfile="a.toml"\n',
        '[liquids]\nthick.file\t= "a.toml"\n',
        '[liquids]\nthick = { "file" = "a.toml" }\n',
        "[liquids]\nthick = { 'file' = 'a.toml' }\n",
    ],
)
def test_a_liquid_file_is_found_however_its_key_is_written(text: str) -> None:
    source = StudySource(text.encode()).with_liquids(lambda name: f"# {name}")
    assert StudySource.split(source.content) == source == (text.encode(), {"a.toml": "# a.toml"}, {})


def test_the_word_in_a_comment_is_not_a_file_name() -> None:
    text = b"# This file has no liquid file.\n[liquids.thick]\ndensity_kg_m3 = 1000\n"
    assert StudySource(text).with_liquids(lambda _name: "lost").content == text


DAMPER = '[liquids.damper]\ndrag = { law = "linear", damping_nspm = 12 }\n'


def write_study(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8", newline="\n")
    return path


def test_a_damper_is_loaded_without_a_density(tmp_path: Path) -> None:
    scene = load_scene(write_study(tmp_path / "damper.toml", f"format = 2\n{DAMPER}"), "damper")
    assert scene.liquids[0].drag == Drag(law="linear", damping_nspm=12)
    assert value_of(override_value(scene, "damping_nspm", "20"), "damping_nspm") == 20
    assert steady_force(scene).force_n == pytest.approx(1.2)


def test_the_estimator_of_a_scene_file_is_kalman_unless_it_states_one(tmp_path: Path) -> None:
    text = "format = 2\n[scene]\nscale = 3\n[liquids.water]\ndensity_kg_m3 = 1000\n"
    assert load_scene(write_study(tmp_path / "water.toml", text), "water").velocity == Kalman()
    with_estimator = text.replace("scale = 3", 'scale = 3\nvelocity = { kind = "raw" }')
    assert load_scene(write_study(tmp_path / "water.toml", with_estimator), "water").velocity == Raw()


@pytest.mark.parametrize("kind", ["line", "foaw", "lead"])
def test_a_removed_estimator_is_refused_with_its_place_and_replacement(tmp_path: Path, kind: str) -> None:
    liquid = f'[scene]\nvelocity = {{ kind = "{kind}" }}\n[liquids.water]\ndensity_kg_m3 = 1000\n'
    with pytest.raises(ProtocolError, match=f'"{kind}" has been removed from the program') as error:
        load_scene(write_study(tmp_path / "water.toml", f"format = 2\n{liquid}"), "water")
    (problem,) = error.value.problems
    assert (problem.place, problem.line, problem.hint) == ("scene.velocity.kind", 3, 'write "ewma", "kalman" or "raw"')


def test_the_density_counts_where_effects_are_chosen(tmp_path: Path) -> None:
    text = f'format = 2\n{DAMPER}effects = "auto"\n'
    with pytest.raises(ProtocolError, match="density_kg_m3: is missing"):
        load_scene(write_study(tmp_path / "damper.toml", text), "damper")
    scene = load_scene(write_study(tmp_path / "damper.toml", f"{text}density_kg_m3 = 1000\n"), "damper")
    assert resolve(scene).liquids[0].drag == Drag(law="linear", damping_nspm=12)
    assert "drag law: linear, as specified in the file" in "\n".join(describe_gate(scene))


def test_a_scene_with_a_damper_is_read_as_it_was_written(tmp_path: Path) -> None:
    damper = Scene(liquids=(Liquid(id="damper", density_kg_m3=1000, drag=Drag(law="linear", damping_nspm=3)),))
    assert load_scene(write_study(tmp_path / "damper.toml", scene_text(damper)), "damper") == damper
    assert "damping_nspm" not in scene_text(Scene(liquids=(Liquid(id="water", density_kg_m3=1000),)))


def test_effects_that_accuracy_excludes_are_not_chosen(tmp_path: Path) -> None:
    liquid = '[liquids.honey]\ndensity_kg_m3 = 1420\nviscosity_pa_s = 10\neffects = "auto"\n[scene]\nscale = 3\n'
    effects_of = {}
    for without in ("[]", '["unsteady_drag"]'):
        text = f"format = 2\n{liquid}accuracy.without = {without}\n"
        scene = load_scene(write_study(tmp_path / "honey.toml", text), "honey")
        assert load_scene(write_study(tmp_path / "again.toml", scene_text(scene)), "honey") == scene
        effects_of[without] = resolve(scene).liquids[0].effects
    assert effects_of == {
        "[]": ("buoyancy", "unsteady_drag"),
        '["unsteady_drag"]': ("drag", "buoyancy", "added_mass", "history"),
    }


@pytest.mark.parametrize("head", ["", "format = 1\n"])
def test_a_scene_file_of_an_earlier_format_is_to_be_upgraded(tmp_path: Path, head: str) -> None:
    with pytest.raises(ProtocolError, match=r"format: is 1, .*run liquid-study upgrade FILE"):
        load_scene(write_study(tmp_path / "water.toml", f"{head}[liquids.water]\ndensity_kg_m3 = 1000\n"), "water")


def test_a_scene_file_states_the_fade(tmp_path: Path) -> None:
    text = "[scene]\nfade_s = 0.3\n[liquids.water]\ndensity_kg_m3 = 1000\n"
    scene = load_scene(write_study(tmp_path / "water.toml", f"format = 2\n{text}"), "water")
    assert scene.fade_s == 0.3
    assert load_scene(write_study(tmp_path / "again.toml", scene_text(scene)), "water") == scene
    assert "fade_s" not in scene_text(override_value(scene, "fade_s", 0.05))


@pytest.mark.parametrize("content", [b"x = 1\n" * 300_000, b"# a comment\n" * 100_000, b"a." * 600_000 + b"a = 1"])
def test_a_file_that_is_larger_than_any_study_is_refused_at_once(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "large.toml"
    file.write_bytes(content)
    begun_s = time.perf_counter()
    with pytest.raises(ProtocolError, match=r"file: is 1\.\d MB in size, but a study file may be at most 1 MB"):
        load(str(file))
    with pytest.raises(ProtocolError, match="check that it is a study file"):
        parse(content, "large")
    assert time.perf_counter() - begun_s < 2.0
