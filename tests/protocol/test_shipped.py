"""The protocols that ship: the thesis' study exactly, and a demonstration of three minutes."""

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from study_app.haptics.model.effects.drag import resistance_n
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.scene import Ewma, Kalman
from study_app.haptics.model.slope_limits import slope_limit
from study_app.protocol.describe import describe
from study_app.protocol.liquid_summary import effects, warnings
from study_app.protocol.load import load, load_scene, load_scenes, parse
from study_app.protocol.orders.block_orders import orders_of
from study_app.protocol.orders.schedule import FormStep, Trial, build_schedule
from study_app.protocol.source import files
from study_app.protocol.source.files import at_hand, shipped
from study_app.viewmodels.home import is_shipped
from tests.protocol.sound import SOUND

PROTOCOLS = Path(__file__).parents[2] / "protocols"
NAMES = sorted(path.stem for path in PROTOCOLS.glob("*.toml"))


def test_what_ships_is_listed():
    tracked = subprocess.run(["git", "ls-files", "*.toml"], cwd=PROTOCOLS, capture_output=True, text=True, check=False)
    assert shipped() == tuple(sorted(Path(name).stem for name in tracked.stdout.split()) or NAMES)


def test_a_study_made_in_a_checkout_does_not_ship(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "study_app").mkdir()
    shutil.copytree(PROTOCOLS, tmp_path / "protocols")
    text = (PROTOCOLS / "demo.toml").read_text(encoding="utf-8")
    (tmp_path / "protocols" / "mine.toml").write_text(text.replace('"demo"', '"mine"'), encoding="utf-8")
    monkeypatch.setattr(files, "_PACKAGE", tmp_path / "study_app")
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    assert is_shipped("demo")
    assert not is_shipped("mine")
    assert [name for name in at_hand() if name == "mine"] == ["mine"]


@pytest.mark.parametrize("name", NAMES)
def test_what_ships_is_sound_and_named_like_its_file(name: str):
    protocol = load(PROTOCOLS / f"{name}.toml")
    assert protocol.study.name == name.replace("_", "")
    steps = build_schedule(protocol, "P001", 1).steps
    assert orders_of(protocol).answers == sum(len(step.items) for step in steps if isinstance(step, Trial | FormStep))


NAMED = {
    "liquids",
    "conditions",
    "tasks",
    "scales",
    "questionnaires",
    "pages",
    "blocks",
    "stimuli",
    "designs",
    "methods",
}


def keys_with_comments(text: str) -> tuple[set[str], set[str]]:
    """Return the kinds of key of a file (names of tables and indices left out), and those with a comment by them."""
    kinds: set[str] = set()
    commented: set[str] = set()
    table, above, in_string = "", False, False
    for line in text.splitlines():
        quotes = line.count('"""')
        if in_string:
            in_string = quotes == 0
            continue
        if header := re.match(r"\[+([\w.]+)\]+", line):
            steps = header[1].split(".")
            named = steps[0] in NAMED
            table = ".".join([steps[0], *(steps[2:] if named else steps[1:])])
            kind = table
        elif key := re.match(r"(\w+)(?:\.\w+)? *=", line):
            kind = f"{table}.{key[1]}".removesuffix(".en").removesuffix(".nl")
            kinds.add(kind)
        else:
            above = line.startswith("#") or (above and bool(line.strip()))
            continue
        if above or re.search(r"\s# ", line):
            commented.add(kind)
        above = False
        in_string = quotes == 1
    return kinds, commented


@pytest.mark.parametrize("name", NAMES)
def test_every_kind_of_key_is_commented_there_or_in_a_file_that_it_names(name: str):
    text = (PROTOCOLS / f"{name}.toml").read_text(encoding="utf-8")
    kinds, commented = keys_with_comments(text)
    assert len(kinds) > 30
    words = " ".join(text.replace("#", " ").split())
    if explained := re.search(r"keys are explained in (\w+)\.toml and (\w+)\.toml", words):
        for other in explained.groups():
            commented |= keys_with_comments((PROTOCOLS / f"{other}.toml").read_text(encoding="utf-8"))[1]
    assert kinds - commented == set()


def texts(node: Any):
    """Yield every pair of English and Dutch texts."""
    if isinstance(node, dict):
        if isinstance(node.get("en"), str):
            yield node["en"], node["nl"]
        for value in node.values():
            yield from texts(value)
    elif isinstance(node, list):
        for value in node:
            yield from texts(value)


PHYSICAL = load("physical_liquids")
LAWS = ("constant", "haider-levenspiel")


def dense(other_kg_m3: float | str, **more: str):
    """Return the small study with a main block of two liquids with drag alone, of 1000 and ``other_kg_m3``."""
    text = SOUND.replace(
        'effects = ["drag", "wake"]\nwake = { length = 100, scaling = 200, exponent = 0.5 }', more.get("thin", "")
    )
    return parse(text.replace("density_kg_m3 = 1400", f"density_kg_m3 = {other_kg_m3}").encode(), "small.toml")


@pytest.mark.parametrize(("other", "alike"), [(1380, True), (1395, False), (725, True), (715, False)])
def test_a_pair_of_a_block_is_told_apart_from_39_percent_of_the_smaller_on(other: float, alike: bool):
    told = [warning for warning in warnings(dense(other)) if "hard to tell apart" in warning]
    assert len(told) == alike
    if alike:
        assert told[0].startswith("thin and thick of block ")
        assert "0.85 and" in told[0]


def test_liquids_that_meet_in_no_main_block_are_not_compared():
    """The third liquid, 1200 kg/m³, differs by 20 and 17 % from the others."""
    assert not any("other" in warning for warning in warnings(dense(1400)))


def test_a_pair_whose_drag_nobody_feels_is_alike():
    auto = 'viscosity_pa_s = 1e-5\neffects = "auto"'
    study = dense(f"900\n{auto}", thin=auto)
    slow = study.model_copy(update={"scene": study.scene.model_copy(update={"scale": 0.1})})
    assert len([warning for warning in warnings(slow) if "0.00 and 0.00 N" in warning]) == 1


def test_a_clipped_liquid_is_named_with_what_is_left_of_it():
    (norm,) = [warning for warning in warnings(dense(20_000)) if "clipped" in warning]
    assert norm == "thick is clipped: at 0.1 m/s of the hand the slope limit, which keeps the servo stable, lets " + (
        f"{slope_limit(1e-3, 1) * 0.1:.2f} of its 17.07 N through"
    )
    weak = dense(5_000)
    weak = weak.model_copy(update={"device": weak.device.model_copy(update={"force_limit_n": 3})})
    assert "thick is clipped: at 0.1 m/s of the hand the force limit lets 3.00 of its 4.27 N through" in warnings(weak)


def test_practice_in_a_liquid_that_is_judged_later_is_permitted_and_told():
    study = parse(SOUND.replace('liquid = "other"', 'liquid = "thick"').encode(), "small.toml")
    (told,) = [warning for warning in warnings(study) if "practice" in warning]
    assert told.startswith("practice warm_up is in thick, which block feel presents too")
    assert f"  {told}" in describe(study)
    assert not any("practice" in warning for warning in warnings(dense(1400)))


@pytest.mark.parametrize("name", ["rek2024", "demo"])
def test_the_thesis_liquids_need_no_warning(name: str):
    protocol = load(name)
    assert warnings(protocol) == ()
    assert "Warnings" not in describe(protocol)


@pytest.mark.parametrize("name", ["physical_liquids", "physical2"])
def test_of_the_physical_liquids_only_the_tar_of_the_demonstration_is_warned_of(name: str):
    protocol = load(name)
    (warning,) = warnings(protocol)
    assert warning.startswith("tar is clipped")
    assert describe(protocol).endswith(f"Warnings\n  {warning}")


def test_the_second_edition_of_the_physical_liquids_differs_in_estimator_and_in_what_auto_chooses():
    first, second = (load(name) for name in ("physical_liquids", "physical2"))
    assert (first.liquids, first.conditions) == (second.liquids, second.conditions)
    assert (first.scene.velocity, second.scene.velocity) == (Ewma(), Kalman())
    assert first.scene.model_copy(update={"velocity": Kalman()}) == second.scene
    chosen = {name: resolve(second.scene_of(name)).liquids[0].effects for name in second.liquids}
    assert chosen.pop("water") == ("drag", "added_mass")
    assert all("unsteady_drag" in effects and "drag" not in effects for effects in chosen.values())
    assert not any("unsteady_drag" in resolve(first.scene_of(name)).liquids[0].effects for name in first.liquids)


def test_a_constant_coefficient_in_a_viscous_liquid_is_warned_of_with_its_error():
    study = dense("1400\nviscosity_pa_s = 10")
    (told,) = [warning for warning in warnings(study) if "ignores it" in warning]
    assert told.startswith(
        "thick has a viscosity, but its constant drag coefficient ignores it: at 0.1 m/s of the hand"
    )
    named_n, true_n = (resistance_n(study.scene_of("thick"), study.liquids["thick"].alone, 1.0, law) for law in LAWS)
    assert f"is {named_n:.2f} instead of {true_n:.2f} N, an error of {true_n - named_n:.2f} N" in told
    assert true_n - named_n > 5
    assert not any("ignores it" in warning for warning in warnings(dense("1400\nviscosity_pa_s = 1e-3")))


@pytest.mark.parametrize(("effects", "warned"), [("buoyancy", True), ("drag", False)])
def test_a_viscous_liquid_without_drag_is_warned_of_with_its_error(effects, warned):
    law = '\ndrag = { law = "haider-levenspiel" }'
    study = dense(f'1400\nviscosity_pa_s = 10\neffects = ["{effects}"]{law if effects == "drag" else ""}')
    found = [warning for warning in warnings(study) if warning.startswith("thick has a viscosity")]
    assert bool(found) == warned
    for warning in found:
        true_n = resistance_n(study.scene_of("thick"), study.liquids["thick"].alone, 1.0, LAWS[1])
        assert f"leave out drag: at 0.1 m/s of the hand its drag is 0.00 instead of {true_n:.2f} N" in warning


def test_every_liquid_has_its_table_of_effects():
    lines = effects(PHYSICAL)
    headings = [line.split(":")[0] for line in lines if line and not line.startswith(" ")]
    assert headings == list(PHYSICAL.liquids)
    assert "  Effects in each liquid" not in describe(PHYSICAL)
    told = describe(PHYSICAL)
    assert all(f"  {line}" in told for line in lines if line)


def test_named_effects_are_told_too():
    told = effects(load("rek2024"))
    drag, wake = (line.split() for line in told[2:4])
    assert (drag[0], drag[3], wake[0], wake[3]) == ("drag", "in", "wake", "in")
    assert any(line.split()[0] == "added_mass" and line.endswith("not named") for line in told if line)


def test_the_scene_of_a_liquid_has_all_that_the_file_says():
    scenes = load_scenes("physical_liquids")
    assert list(scenes) == list(PHYSICAL.liquids)
    assert scenes["tar"] == load_scene("physical_liquids", "tar") == PHYSICAL.scene_of("tar")
    assert scenes["honey"] == PHYSICAL.scene_for("honey")
    assert (scenes["honey"].motion.speed_mps, scenes["honey"].accuracy.relative) == (0.6, 0.05)
    assert scenes["honey"].force_limit_n == 8


@pytest.mark.parametrize(
    "estimator", ['kind = "line"', 'kind = "foaw"\ntolerance_m = 1e-5', 'kind = "raw"', 'kind = "ewma"\nalpha = 0.2']
)
def test_a_study_may_choose_its_estimator(estimator: str):
    protocol = parse(SOUND.replace("scale = 10", f"scale = 10\n[scene.velocity]\n{estimator}").encode(), "small.toml")
    assert protocol.scene_for("is_thin").velocity.kind == estimator.split('"')[1]


def test_a_scene_file_may_say_auto_and_give_its_motion(tmp_path):
    file = tmp_path / "oil.toml"
    file.write_text(
        "format = 1\n[scene]\nscale = 2\nmotion = { speed_mps = 1, depth_m = [-0.1, 0.2] }\n"
        "accuracy = { relative = 0.1 }\n"
        '[liquids.oil]\ndensity_kg_m3 = 900\nviscosity_pa_s = 0.1\neffects = "auto"\n'
        'region = { kind = "box", size_m = [1, 1, 1] }\n',
        encoding="utf-8",
    )
    scene = load_scene(file, "oil")
    assert scene.motion_in(scene.liquids[0]).depth_m == (-0.1, 0.2)
    assert scene.accuracy.relative == 0.1
