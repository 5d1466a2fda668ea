"""The force link in a protocol: its keys, what check refuses and warns of, and what an interval presents of it."""

import pytest

from study_app.haptics.model.scene import PROMPT_LINK, ForceLink
from study_app.protocol.checks.force_limits import longest_delay_ms, returned_j
from study_app.protocol.descriptions.protocol_text import describe
from study_app.protocol.load import load, parse
from study_app.protocol.model import Protocol
from study_app.protocol.presented.presentation import link_seed
from study_app.protocol.trials.stimuli import Stimulated
from study_app.protocol.trials.tasks import Stroke
from study_app.protocol.warnings.delayed_force import STIRRED, delay_warnings
from study_app.store.verification.leaks import telltales
from tests.protocol.edited_studies import text_of

STUDY = text_of("late")
PACED = Stroke(1.0, 0.02)


def study(*edits: tuple[str, str]) -> Protocol:
    text = STUDY
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return parse(text.encode(), "late.toml")


def test_the_returned_energy_is_that_of_a_late_damper() -> None:
    for delay_ms, energy_mj in ((80, 0.21), (100, 0.40), (150, 1.28)):
        assert 1e3 * returned_j(4, PACED, delay_ms / 1000) == pytest.approx(energy_mj, abs=0.005)
    assert longest_delay_ms(4, PACED) == 108
    assert longest_delay_ms(0.1, PACED) == 200
    assert STIRRED.speed_mps == pytest.approx(0.2, rel=1e-3)


def test_an_interval_presents_its_link() -> None:
    protocol = study()
    assert protocol.has_imperfect_link
    assert not load("rek2024").has_imperfect_link
    assert protocol.presented_scene(Stimulated("water"), 7).link == ForceLink(delay_s=0.01, seed=7)
    assert protocol.presented_scene(Stimulated("damper"), 7).link == PROMPT_LINK
    varied = protocol.presented_scene(Stimulated("damper", "force_delay_ms", 80.0), 7)
    assert varied.link == ForceLink(delay_s=0.08, seed=7)
    assert varied.liquids == protocol.scene_for("damper").liquids
    jittered = study(("force_delay_ms = 10", "force_delay_ms = 12\nforce_jitter_ms = 3\nforce_loss = 0.1"))
    assert jittered.presented_scene(Stimulated("water"), 7).link == ForceLink(
        delay_s=0.012, jitter_s=0.003, loss=0.1, seed=7
    )
    damping = protocol.presented_scene(Stimulated("water", "wake.scaling", 2000.0), 7)
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
    assert all(0 <= seed < 2**32 for seed in seeds)
    assert link_seed(1, "P001", 3, 1, None) == link_seed(1, "P001", 3, 1, 1)


def test_the_numbers_of_a_link_are_searched_for_as_leaks() -> None:
    protocol = study(("force_delay_ms = 10", "force_delay_ms = 12.345\nforce_jitter_ms = 3.217\nforce_loss = 0.12345"))
    words = telltales(protocol)
    for text in ("12.345", "0.012345", "3.217", "0.12345"):
        assert words.in_text(f"a {text} b"), text


@pytest.mark.slow
def test_forcedelay_is_permitted_whole() -> None:
    protocol = load("forcedelay")
    assert protocol.format == 2
    assert not [*delay_warnings(protocol)]
    assert "2IFC of force_delay_ms, standard 0" in describe(protocol)
