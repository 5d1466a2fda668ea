"""The protocols that ship: the thesis' study exactly, and a demonstration of three minutes."""

import re
import shutil
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import pytest

from study_app.haptics.model.scene import Body, Ewma, Knee
from study_app.protocol.load import load
from study_app.protocol.model import Explore, Reach
from study_app.protocol.orders.block_orders import orders_of
from study_app.protocol.orders.schedule import FormStep, Trial, build_schedule
from study_app.protocol.source import files
from study_app.protocol.source.files import at_hand, shipped
from study_app.viewmodels.home import is_shipped

PROTOCOLS = Path(__file__).parents[2] / "protocols"
NAMES = sorted(path.stem for path in PROTOCOLS.glob("*.toml"))
REK = load("rek2024")


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


def test_the_thesis_asks_62_times():
    assert orders_of(REK).answers == 62
    assert REK.parts == 2


@pytest.mark.parametrize(
    ("name", "density", "wake"),
    [("water", 1000, (1700, 1700, 0.75)), ("honey", 1400, None), ("light_oil", 4500, (125, 250, 0.25))],
)
def test_the_thesis_liquids(name: str, density: float, wake: tuple[int, float, float] | None):
    scene = REK.scene_for(name)
    (liquid,) = scene.liquids
    assert liquid.density_kg_m3 == density
    assert liquid.region.kind == "everywhere"
    assert liquid.effects == (("drag",) if wake is None else ("drag", "wake"))
    if wake is None:
        assert liquid.wake is None
    else:
        assert liquid.wake is not None
        assert (liquid.wake.length, liquid.wake.scaling, liquid.wake.exponent) == wake
        assert (liquid.wake.breaking_angle_deg, liquid.wake.breaking_span_m) == (45, 0.068)
        assert (liquid.wake.decay, liquid.wake.resolution_m, liquid.wake.axes) == (0.999975, 0, "xz")


def test_the_thesis_scene():
    scene = REK.scene_for("water")
    assert (scene.scale, scene.rate_hz, scene.force_limit_n) == (10, 1000, 8)
    assert scene.body == Body(diameter_m=0.068, drag_coefficient=0.47)
    assert scene.velocity == Ewma(alpha=0.1)
    assert scene.knee == Knee(law="sqrt", threshold_mps=5)


def test_the_thesis_parts():
    liquids, delays = REK.main_blocks
    assert (liquids.part, delays.part) == (1, 2)
    assert sorted(liquids.conditions) == ["honey", "light_oil", "water"]
    assert [REK.delay_s(name) for name in liquids.conditions] == [0, 0, 0]
    assert [round(REK.delay_s(name) * 1000) for name in delays.conditions] == [0, 50, 75, 100, 125, 150, 200]
    assert {REK.conditions[name].liquid for name in delays.conditions} == {"water"}
    assert liquids.order == delays.order == "shuffled"
    explore, reach = REK.tasks[liquids.task], REK.tasks[delays.task]
    assert isinstance(explore, Explore)
    assert (explore.min_s, explore.max_s) == (30, 120)
    assert isinstance(reach, Reach)
    assert reach.targets_m == ((-0.03, 0, 0), (0.03, 0, 0))
    assert (reach.radius_m, reach.dwell_s, reach.count) == (0.006, 0.5, 12)


def test_part_two_begins_with_30_s_of_its_own_task_in_time():
    order = [step for step in REK.sequence if step in REK.blocks]
    assert order == ["practice", "liquids", "baseline", "delays"]
    baseline, reach = REK.tasks["reach_for_30_s"], REK.tasks["reach"]
    assert isinstance(baseline, Reach)
    assert isinstance(reach, Reach)
    assert baseline.duration_s == 30
    assert (baseline.targets_mm, baseline.radius_mm, baseline.dwell_s) == (
        reach.targets_mm,
        reach.radius_mm,
        reach.dwell_s,
    )
    (condition,) = REK.blocks["baseline"].conditions
    assert REK.delay_s(condition) == 0
    assert REK.conditions[condition].liquid == "water"
    page = REK.pages[REK.sequence[REK.sequence.index("baseline") - 1]]
    assert "baseline" in REK.text(page.body, "en")
    assert "nulmeting" in REK.text(page.body, "nl")


def test_practice_is_in_a_liquid_of_its_own():
    (practised,) = REK.scene_for("practice").liquids
    others = [REK.conditions[name].liquid for name in REK.conditions if name != "practice"]
    assert practised.id not in others
    assert REK.questionnaire_of("practice") is None


ITEMS = {
    "liquid": [
        "I think this feels like interacting with a liquid.",
        "Interacting with this application feels immersive.",
        "The strength of the force feedback is adequate.",
        "The simulated liquid behaves in a way I expect.",
        "This liquid behaves like honey.",
        "This liquid behaves like water.",
        "This liquid behaves like slime.",
        "This liquid behaves like oil.",
        "This liquid behaves like tar.",
    ],
    "delay": [
        "The visual feedback is different from the baseline performance.",
        "The difference in visual feedback makes the task harder.",
        "The difference in visual feedback detracts from my experience.",
        "The difference in visual feedback makes the system unusable.",
        "I feel comfortable interacting with this application.",
    ],
}
LABELS = (
    "Completely disagree",
    "Mostly disagree",
    "Somewhat disagree",
    "Neutral",
    "Somewhat agree",
    "Mostly agree",
    "Completely agree",
)


@pytest.mark.parametrize("name", ITEMS)
def test_the_thesis_statements_word_for_word(name: str):
    questionnaire = REK.questionnaires[name]
    assert [REK.text(item.text, "en") for item in questionnaire.items] == ITEMS[name]
    assert questionnaire.item_order == "fixed"
    assert REK.labels(questionnaire.scale, "en") == LABELS
    assert REK.scales[questionnaire.scale].cannot_judge is None


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


def test_every_dutch_text_is_a_translation():
    document = tomllib.loads((PROTOCOLS / "rek2024.toml").read_text(encoding="utf-8"))
    pairs = list(texts(document))
    assert len(pairs) > 50
    assert all(english != dutch for english, dutch in pairs)
    assert all(0.6 < len(dutch) / len(english) < 1.7 for english, dutch in pairs if len(english) > 20)


def test_the_demo_needs_little():
    demo = load("demo")
    assert orders_of(demo).answers == 8
    assert demo.parts == 2
