"""The force link in a protocol: its keys, what check refuses and warns of, and what an interval presents of it."""

from collections.abc import Sequence

import pytest

from study_app.errors import ProtocolError
from study_app.haptics.model.force_link import PROMPT, ForceLink
from study_app.protocol.checks.delay_warnings import STIRRED, delay_warnings
from study_app.protocol.checks.returned_energy import longest_ms, returned_j
from study_app.protocol.describe import describe
from study_app.protocol.load import load, parse, source_bytes
from study_app.protocol.model import Protocol
from study_app.protocol.trials.presentation import delays_force, link_seed, scene_of
from study_app.protocol.trials.stimuli import Stimulated
from study_app.protocol.trials.tasks.stroke import Stroke
from study_app.store.verification.leaks import telltales

STUDY = """\
format = 2
study.name = "late"
[device]
workspace_mm = [100, 60, 60]
[scene]
scale = 10
[liquids.water]
density_kg_m3 = 1000
effects = ["drag", "wake"]
wake = { length = 1700, scaling = 1700, exponent = 0.75 }
[liquids.damper]
drag = { law = "linear", damping_nspm = 4 }
[conditions.water]
liquid = "water"
force_delay_ms = 10
[conditions.damper]
liquid = "damper"
[tasks.stir]
kind = "follow"
[stimuli.delay]
condition = "damper"
vary = "force_delay_ms"
levels = [2, 100]
[methods.few]
kind = "constant"
levels = 4
repetitions = 2
[blocks.pairs]
stimulus = "delay"
method = "few"
[blocks.named]
conditions = ["water", "damper"]
standard = "damper"
design = "2ifc"
repetitions = 2
"""
PACED = Stroke(1.0, 0.02)


def study(*edits: tuple[str, str]) -> Protocol:
    text = STUDY
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return parse(text.encode(), "late.toml")


def problems(*edits: tuple[str, str]) -> Sequence[tuple[str, str, str]]:
    with pytest.raises(ProtocolError) as caught:
        study(*edits)
    return [(one.place, one.message, one.hint) for one in caught.value.problems]


def test_the_returned_energy_is_that_of_a_late_damper() -> None:
    for delay_ms, energy_mj in ((80, 0.21), (100, 0.40), (150, 1.28)):
        assert 1e3 * returned_j(4, PACED, delay_ms / 1000) == pytest.approx(energy_mj, abs=0.005)
    assert longest_ms(4, PACED) == 108
    assert longest_ms(0.1, PACED) == 200
    assert STIRRED.speed_mps == pytest.approx(0.2, rel=1e-3)


@pytest.mark.parametrize(
    ("edits", "place", "message", "hint"),
    [
        (
            [("levels = [2, 100]", "levels = [2, 150]")],
            "stimuli.delay.levels",
            "4 N·s/m delayed by 150 ms returns 1.3 mJ per motion reversal; the passivity controller removes it",
            "at most 108 ms, which return 0.5 mJ",
        ),
        (
            [("levels = [2, 100]", "levels = [2, 201]")],
            "stimuli.delay.levels",
            "201 ms above a standard of 0 is 201; force_delay_ms may be at most 200",
            "at most 200",
        ),
        (
            [
                (
                    'vary = "force_delay_ms"\nlevels = [2, 100]',
                    'vary = "force_loss"\nstandards = [0.2]\nlevels = [0.5, 2]',
                )
            ],
            "stimuli.delay.levels",
            "level 2 gives 0.6; force_loss may be at most 0.5",
            "at most 0.5",
        ),
        (
            [('vary = "force_delay_ms"', 'vary = "force_dely_ms"')],
            "stimuli.delay.vary",
            'there is no number "force_dely_ms" in condition "damper"',
            'did you mean "force_delay_ms"?',
        ),
        (
            [("force_delay_ms = 10", "force_delay_ms = 201")],
            "conditions.water.force_delay_ms",
            "is 201, must be at most 200",
            "",
        ),
    ],
)
def test_check_names_the_mistake(edits: list[tuple[str, str]], place: str, message: str, hint: str) -> None:
    ((found_place, found, found_hint),) = problems(*edits)
    assert (found_place, found) == (place, message)
    assert hint in found_hint


def test_the_keys_belong_to_format_2() -> None:
    text = (
        source_bytes("demo")
        .decode()
        .replace("[conditions.thin]", "[conditions.thin]\nforce_loss = 0.1\nforce_jitter_ms = 3")
    )
    with pytest.raises(ProtocolError) as caught:
        parse(text.encode(), "old.toml")
    found = {(one.place, one.message) for one in caught.value.problems}
    assert found == {
        ("conditions.thin.force_loss", "belongs to format 2"),
        ("conditions.thin.force_jitter_ms", "belongs to format 2"),
    }
    demo = load("demo").conditions["thin"].model_dump()
    assert not any(name.startswith("force_") for name in demo)


def test_a_condition_beyond_the_stored_table_is_warned_of_in_newtons_and_percent() -> None:
    assert not [*delay_warnings(study())]
    (water,) = delay_warnings(study(("force_delay_ms = 10", "force_delay_ms = 50")))
    assert water.startswith("conditions.water.force_delay_ms: with 50 ms the passivity controller withholds about 76 %")
    assert water.endswith("N at 0.2 m/s): choose at most 10 ms, or delay the picture")
    assert "of 3.4 N" in water
    longer = study(('liquid = "damper"\n', 'liquid = "damper"\nforce_delay_ms = 0\n'), ("force_delay_ms = 10\n", ""))
    assert not [*delay_warnings(longer)]
    late = STUDY.replace('liquid = "damper"', 'liquid = "damper"\nforce_delay_ms = 150').replace(
        'condition = "damper"\nvary = "force_delay_ms"\nlevels = [2, 100]',
        'condition = "water"\nvary = "force_delay_ms"\nlevels = [0.5, 1]',
    )
    (damper,) = delay_warnings(parse(late.encode(), "late.toml"))
    assert "a force of 0.5 N at 0.13 m/s returns 1.3 mJ per motion reversal" in damper
    assert "choose at most 108 ms" in damper


def test_a_link_is_described_and_makes_conditions_differ() -> None:
    one = study(("force_delay_ms = 10", "force_delay_ms = 10\nforce_jitter_ms = 3\nforce_loss = 0.1"))
    assert "force 10 ms late, force jitter 3 ms, 10 % of forces lost" in describe(one)
    same = [('liquid = "damper"\n', 'liquid = "water"\n'), ("levels = [2, 100]", "levels = [2, 50]")]
    study(*same)
    ((place, message, _),) = problems(*same, ("force_delay_ms = 10\n", ""))
    assert (place, message) == ("blocks.named.conditions.2", '"damper" presents the same as "water"')


def test_an_interval_presents_its_link() -> None:
    one = study()
    assert delays_force(one)
    assert not delays_force(load("rek2024"))
    assert scene_of(one, Stimulated("water"), 7).link == ForceLink(delay_s=0.01, seed=7)
    assert scene_of(one, Stimulated("damper"), 7).link == PROMPT
    varied = scene_of(one, Stimulated("damper", "force_delay_ms", 80.0), 7)
    assert varied.link == ForceLink(delay_s=0.08, seed=7)
    assert varied.liquids == one.scene_for("damper").liquids
    damping = scene_of(one, Stimulated("water", "wake.scaling", 2000.0), 7)
    assert damping.link.delay_s == 0.01
    assert damping.liquids[0].wake is not None
    assert damping.liquids[0].wake.scaling == 2000


def test_each_attempt_and_interval_has_jitter_of_its_own() -> None:
    seeds = {
        link_seed(seed, who, trial, attempt, interval)
        for seed in (1, 2)
        for who in ("P001", "P002")
        for trial in (1, 2)
        for attempt in (1, 2)
        for interval in (1, 2)
    }
    assert len(seeds) == 32
    assert all(0 <= one < 2**32 for one in seeds)
    assert link_seed(1, "P001", 3, 1, None) == link_seed(1, "P001", 3, 1, 1)


def test_the_numbers_of_a_link_are_searched_for_as_leaks() -> None:
    one = study(("force_delay_ms = 10", "force_delay_ms = 12.345\nforce_jitter_ms = 3.217\nforce_loss = 0.12345"))
    words = telltales(one)
    for text in ("12.345", "0.012345", "3.217", "0.12345"):
        assert words.in_text(f"a {text} b"), text


@pytest.mark.slow
def test_forcedelay_is_permitted_whole() -> None:
    one = load("forcedelay")
    assert one.format == 2
    assert not [*delay_warnings(one)]
    assert "2IFC of force_delay_ms, standard 0" in describe(one)
