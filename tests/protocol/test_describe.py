"""What [analysis] plans of a study with levels: participants, precision and published values."""

import json
from pathlib import Path

import pytest

from study_app.errors import ProtocolError
from study_app.protocol.describe import describe
from study_app.protocol.formats import newer_keys
from study_app.protocol.load import load, parse
from study_app.protocol.orders.durations import expected_duration_s
from study_app.protocol.orders.schedule import draw_key
from study_app.protocol.streams import stream
from study_app.store.blinded.blinding import open_or_draw_key, read_key
from study_app.store.blinded.whole_protocol import whole_protocol
from study_app.store.receipt import without_conditions
from tests.protocol.sound import ORDER, SOUND
from tests.protocol.trials.level_studies import study, text_of
from tests.protocol.trials.test_due import CONDITIONS

REK = load("rek2024")


@pytest.mark.parametrize(
    "words",
    [
        "Feeling simulated liquids (rek2024, version 1.0)",
        "Languages          en, nl",
        "Parts              2",
        "Answers            62 per participant",
        "Blinding           double-blind: the operator sees no force",
        "Expected duration  about 18 min",
        "Force limit        8 N",
        "100 × 60 × 60 mm of the hand, 10 times as large in the scene",
        "68 mm, 6.8 mm of the hand",
        "Part 1: Baseline settings (block liquids, main)",
        "Trials       7 trials, another order for each participant",
        "Recorded as  D1, D2, D3, D4, D5, D6, D7",
        "explore for 30 to 120 s",
        "9 statements (questionnaire liquid), in the order written",
        "for 30 s",
        "until 12 are reached, at most 120 s",
        "water      1000 kg/m³  drag, wake  1700    1700  0.75",
        "honey      1400 kg/m³  drag        –       –     –",
        "light_oil  4500 kg/m³  drag, wake  125     250   0.25",
        "delay_125  water      seen 125 ms late",
        "like_honey    This liquid behaves like honey.",
        "from 1 (Completely disagree) to 7 (Completely agree)",
        "Equivalent       answers as without delay, to within 1 point of the scale",
        "Recognised       water by like_water, honey by like_honey, light_oil by like_oil",
        "Fall with delay  comfortable",
    ],
)
def test_the_thesis_study_in_words(words: str):
    assert words in describe(REK)


def test_every_page_block_condition_and_item_is_told():
    told = describe(REK)
    for page in REK.pages.values():
        assert REK.text(page.title, "en") in told
    for name in (*REK.blocks, *REK.conditions, *REK.liquids, *REK.questionnaires):
        assert name in told
    for questionnaire in REK.questionnaires.values():
        for item in questionnaire.items:
            assert REK.text(item.text, "en") in told


def test_no_line_ends_in_blanks():
    assert all(line == line.rstrip() for line in describe(REK).splitlines())


REST = """
[pages.rest]
kind = "break"
title = { en = "Rest", nl = "Rust" }
body = { en = "Let go.", nl = "Laat los." }
"""


def edited(*edits: tuple[str, str]):
    text = SOUND
    for old, new in edits:
        assert text.count(old) == 1
        text = text.replace(old, new)
    return parse(text.encode(), "small.toml")


def test_what_only_some_protocols_have():
    told = describe(
        edited(
            ('order = "shuffled"\nrepetitions = 2', "repetitions = 2"),
            ('scale = "agreement"', 'scale = "agreement"\nitem_order = "shuffled"'),
            ("labels.nl", 'cannot_judge = { en = "No idea", nl = "Geen idee" }\nlabels.nl'),
            ('id = "cold"', 'id = "cold"\nrequired = false'),
            ('liquids = ["thin", "thick"]', 'liquids = ["thin", "other"]'),
            ('liquids = ["thin","thick"]', 'liquids = ["thin","other"]'),
            ('conditions = ["apart"]', 'conditions = ["practised"]'),
            ('[conditions.apart]\nliquid = "other"', '[conditions.practised]\nliquid = "syrup"'),
            (
                "[liquids.other]",
                "[liquids.spare]\ndensity_kg_m3 = 950\n[liquids.syrup]\ndensity_kg_m3 = 900\n[liquids.other]",
            ),
        )
    )
    assert "4 trials, every condition 2 times, in the order written: who reads the protocol can tell the codes" in told
    assert "in another order each time" in told
    assert 'to 7 (g), or "No idea"' in told
    assert "(may be left out)" in told
    assert "both       thin + other  seen 120 ms late" in told
    assert told.count("in no condition") == 1


@pytest.mark.parametrize(
    ("new", "words"),
    [
        (
            'order = "constrained"\nmax_repeats = 2\nmin_distance = 2\nrepetitions = 3',
            "6 trials, every condition 3 times, another order for each participant, at most 2 of a kind in a row and "
            "at least 2 trials from one to the next of its kind",
        ),
        ('order = "williams"', "2 trials, in a Williams design of 2 rows"),
        ('order = "latin"', "2 trials, in a Latin square of 2 rows"),
        (
            'order = "latin"',
            "Rows         assigned by the number in the participant's id (P007 is number 7), not by the seed",
        ),
        (f'{ORDER}\nbreak_every = 1\nbreak_page = "rest"', "Breaks       3, after every 1 trial: Rest"),
        (f'{ORDER}\nbreak_every = 2\nbreak_page = "rest"', "Breaks       1, after every 2 trials: Rest"),
    ],
)
def test_orders_and_breaks_are_told(new: str, words: str):
    edits = [(ORDER, new)]
    if "rest" in new:
        edits.append(("[blocks.warm_up]", REST + "[blocks.warm_up]"))
    assert words in describe(edited(*edits))


def test_breaks_take_their_time():
    rest = ("[blocks.warm_up]", REST + "[blocks.warm_up]")
    with_breaks = edited((ORDER, f'{ORDER}\nbreak_every = 1\nbreak_page = "rest"'), rest)
    assert expected_duration_s(with_breaks) - expected_duration_s(edited()) == pytest.approx(3 * (5 + 2 / 3))


def test_the_expected_duration_counts_every_trial():
    """A third repetition adds two trials of exploring and answering."""
    before = expected_duration_s(edited(("repetitions = 2", "repetitions = 1")))
    assert expected_duration_s(edited(("repetitions = 2", "repetitions = 3"))) - before == pytest.approx(
        4 * (6 + 5 + 2 * 6)
    )


def test_a_task_never_lasts_longer_than_its_timeout():
    long = edited(("count = 4", "count = 100"))
    short = edited(("count = 4", "count = 4"))
    assert expected_duration_s(long) - expected_duration_s(short) == pytest.approx(2 * (60 - 4 * 2))


def test_the_demo_takes_three_minutes():
    assert expected_duration_s(load("demo")) == pytest.approx(180, abs=30)


def test_what_was_decided_about_the_analysis_or_that_nothing_was():
    assert "nothing  there is no table [analysis]: the report will call" in describe(
        parse(SOUND.encode(), "small.toml")
    )
    told = describe(parse((SOUND + '[analysis]\nalpha = 0.01\nprimary = ["cold"]\n').encode(), "small.toml"))
    assert "p of at most 0.01" in told
    assert "Primary          cold" in told
    assert "Equivalent       not tested" in told


def test_a_new_study_that_accepts_trials_without_a_target_is_warned_of():
    demo = load("demo")
    later = demo.model_copy(update={"format": 2})
    assert "tasks.reach: a trial that ends without any target reached is valid" in describe(later)
    limits = demo.limits.model_copy(update={"targets_percent": 50})
    assert "without any target" not in describe(later.model_copy(update={"limits": limits}))
    assert "Warnings" not in describe(demo)


PLANNED = """
[analysis]
participants = 20
precision = 0.15

[[analysis.published]]
block = "viscosity"
measure = "weber"
value = 0.1937
standard = 2
percent = 71
n = 10
source = "Jones et al. 1997"
"""


def test_the_plan_is_described() -> None:
    said = describe(study(more=PLANNED))
    assert "Participants     20 planned" in said
    assert "Precision        group mean ±15 % (half its 95 % interval)" in said
    assert "viscosity: weber 0.1937, standard 2, at 71 % correct, n = 10, Jones et al. 1997" in said


def test_published_values_are_in_the_key_and_not_in_the_receipt(tmp_path: Path) -> None:
    protocol = study(more=PLANNED)
    shown = without_conditions(protocol)
    assert "0.1937" not in json.dumps(shown)
    assert shown["analysis"]["participants"] == 20
    open_or_draw_key(tmp_path, protocol, random=stream(1, "key").random)
    whole = whole_protocol(shown, read_key(tmp_path))
    assert whole.analysis == protocol.analysis


def test_a_plan_of_format_1_keeps_its_bytes() -> None:
    plan = study(more="\n[analysis]\nalpha = 0.01\n").analysis
    assert plan is not None
    assert set(plan.model_dump(mode="json")).isdisjoint({"participants", "precision", "published"})
    faults = newer_keys({"analysis": {"participants": 20, "published": [{"block": "a"}]}})
    assert [fault.path for fault in faults] == [("analysis", "participants"), ("analysis", "published")]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('block = "viscosity"', 'block = "viscosities"', 'there is no block of levels "viscosities".*viscosity'),
        ("standard = 2", "standard = 9", "the block has no standard 9.*these: 1, 2"),
        ("standard = 2", "low = 0.3", "low, value and high must ascend"),
        ("precision = 0.15", "precision = 0", "precision"),
        ("participants = 20", "participants = 0", "participants"),
        ("percent = 71", "percent = 171", "percent"),
    ],
)
def test_what_is_wrong_is_named(old: str, new: str, said: str) -> None:
    assert draw_key(study(more=PLANNED), stream(1, "key").random)
    with pytest.raises(ProtocolError, match=said):
        study(more=PLANNED.replace(old, new))
    assert old in text_of(more=PLANNED)


def test_a_block_of_levels_is_described_by_design_levels_and_comparisons() -> None:
    lines = describe(study()).splitlines()
    rows = {line.split("  ")[1].strip(): " ".join(line.split()) for line in lines if line.startswith("  ")}
    assert rows["Design"] == "Design 2IFC of viscosity_pa_s, standard 1, 2: 2 intervals, 0.6 s apart"
    assert rows["Levels"] == "Levels Weber fraction 0.2 to 0.8 (constant), 24 trials per standard"
    assert rows["Comparisons"] == "Comparisons viscosity_pa_s from 1.2 to 3.6 Pa·s"
    assert "None" not in describe(study())


def test_a_paced_damper_is_described_by_its_strongest_force_and_the_slope_limit_of_the_device() -> None:
    protocol = load("viscosityjnd")
    assert protocol.blocks["viscosity"].stimulus == "damping"
    said = " ".join(describe(protocol).split())
    assert "Force at the pace 0.5 to 6.4 N at 0.126 m/s, at most 7.7 N at 1.2 times the pace" in said
    assert "Damping at most 51.2 N·s/m at the hand; the slope limit is 53 " in said
    assert "the slope limit is 20.6 " in " ".join(describe(protocol, delay_ticks=2).split())


def test_compared_conditions_are_described_by_their_standard() -> None:
    assert "ABX against oil: 3 intervals, 0.6 s apart" in describe(study(CONDITIONS))


def test_levels_that_are_values_have_no_standard() -> None:
    text = """
format = 2
study.name = "thickness"
scene.scale = 3
liquids.oil = { density_kg_m3 = 1260, viscosity_pa_s = 4, drag.law = "haider-levenspiel" }
tasks.stir.kind = "follow"
stimuli.viscosity = { vary = "viscosity_pa_s", level = "value", levels = [0.5, 20] }
methods.nine = { kind = "constant", levels = 9, repetitions = 4 }
blocks.thickness = { stimulus = "viscosity", design = "estimation", method = "nine" }
"""
    said = " ".join(describe(parse(text.encode(), "thickness")).split())
    assert "Levels value 0.5 to 20 (constant), 36 trials Comparisons" in said
