"""Instant measures: where limits begin, how long sessions are, which texts reveal a condition, when orders are even."""

import pytest

from study_app.designer.document.study import Study, read
from study_app.designer.document.toml_edits import Set, Unset
from study_app.designer.measures.simulation import balance_of
from study_app.designer.measures.study_facts import (
    copied_texts,
    facts,
    revealing,
    text_keys,
    texts_by_language,
    valid_part,
)
from study_app.haptics.model.slope_limits import slope_limit
from study_app.protocol.load import load
from study_app.protocol.orders.durations import duration_range_s, expected_duration_s
from study_app.protocol.source.files import shipped, shipped_file
from study_app.protocol.trials.presented_levels import level_limits, levels, standard_of
from tests.protocol.faulty_protocols import CASES


def study_of(name: str) -> Study:
    return read(shipped_file(name).read_bytes(), shipped_file(name).parent)


@pytest.mark.parametrize(("name", "block"), [("viscosityjnd", "viscosity"), ("thickness", "thickness")])
def test_a_limit_begins_where_levels_begin_to_be_clipped(name: str, block: str) -> None:
    protocol = load(name)
    limits = level_limits(protocol, protocol.blocks[block])
    assert limits is not None
    assert limits.force is not None
    assert limits.loop is not None
    first = min(limits.force, limits.loop)
    assert standard_of(protocol, block, 0.999 * first).clipped_by is None
    assert standard_of(protocol, block, 1.001 * first).clipped_by is not None
    force = standard_of(protocol, block, limits.force).asked_n
    assert force == pytest.approx(protocol.device.force_limit_n, rel=1e-3)
    if name == "viscosityjnd":
        loop = slope_limit(1 / protocol.device.rate_hz, 1, protocol.scene.velocity)
        assert limits.loop == pytest.approx(loop, rel=1e-4)


def test_a_study_with_clipped_levels_still_has_its_numbers() -> None:
    clipped, _ = study_of("viscosityjnd").edited(Set(("stimuli", "damping", "levels"), [0.02, 3]))
    assert clipped.protocol is None
    assert clipped.formed is not None
    assert facts(clipped).trials
    assert any(one.clipped_by for one in levels(clipped.formed, "viscosity"))
    broken, _ = clipped.edited(Set(("study", "version"), 3))
    assert broken.formed is None


@pytest.mark.parametrize("name", shipped())
def test_the_expected_duration_lies_between_the_shortest_and_the_longest(name: str) -> None:
    protocol = load(name)
    least_s, most_s = duration_range_s(protocol)
    assert least_s <= expected_duration_s(protocol) <= most_s


def test_texts_are_counted_by_language() -> None:
    study = study_of("rek2024")
    (there, wanted), dutch = texts_by_language(study)["en"], texts_by_language(study)["nl"]
    assert there == wanted > 50
    assert dutch == (there, wanted)
    lacking, _ = study.edited(Unset(("blocks", "liquids", "title", "nl")))
    assert texts_by_language(lacking)["nl"] == (wanted - 1, wanted)
    (labels, _), plain = texts_by_language(study)["nl"], Set(("blocks", "liquids", "title"), "Hi")
    without, _ = study.edited(Unset(("scales", "agreement", "labels", "nl")), plain)
    assert texts_by_language(without) == {"en": (wanted, wanted), "nl": (labels - 2, wanted)}
    assert facts(without).missing == {"nl": 2}
    assert {"title", "body", "setting_label", "instruction"} <= text_keys()


def test_texts_that_were_copied_or_are_those_of_a_new_question_are_not_translated() -> None:
    study = study_of("rek2024")
    before = copied_texts(study).get("nl", 0)
    title = study.document["blocks"]["liquids"]["title"]["en"]
    copied, _ = study.edited(Set(("blocks", "liquids", "title", "nl"), title))
    assert copied_texts(copied)["nl"] == before + 1
    new, _ = copied.edited(Set(("questionnaires", "liquid", "items", 0, "text", "nl"), "New question"))
    assert copied_texts(new)["nl"] == before + 2
    assert texts_by_language(new) == texts_by_language(study)


@pytest.mark.parametrize(("text", "word"), [("Now comes Light Oil", "light oil"), ("Seen 50 ms late", "50 ms")])
def test_a_text_that_names_what_is_compared_is_found(text: str, word: str) -> None:
    study = study_of("rek2024")
    assert study.protocol is not None
    assert revealing(study, study.protocol) == ()
    changed, _ = study.edited(Set(("blocks", "liquids", "setting_label", "en"), text))
    assert changed.protocol is not None
    (found,) = revealing(changed, changed.protocol)
    assert (found.path, found.word) == (("blocks", "liquids", "setting_label"), word)


def test_an_order_is_even_at_full_rounds_of_its_square() -> None:
    protocol = load("physical2")
    block = protocol.blocks["liquids"]
    even, uneven = balance_of(protocol, block, 12), balance_of(protocol, block, 13)
    assert even is not None
    assert uneven is not None
    assert (even[2], even[1].balanced) == (6, True)
    assert (uneven[2], uneven[1].balanced) == (6, False)
    assert balance_of(protocol, protocol.blocks["practice"], 12) is None


def test_numbers_continue_while_a_text_is_missing() -> None:
    study = study_of("rek2024")
    lacking, _ = study.edited(Unset(("blocks", "liquids", "title", "nl")), Set(("study", "version"), 3))
    assert lacking.formed is None
    before, after = facts(study), facts(lacking)
    assert (after.trials, after.answers, after.expected_s) == (before.trials, before.answers, before.expected_s)
    assert after.missing == {"nl": 1}


@pytest.mark.slow
def test_numbers_that_depend_on_a_broken_element_are_not_known() -> None:
    study = study_of("rek2024")
    before = facts(study)
    broken, _ = study.edited(Set(("blocks", "liquids", "repetitions"), -1))
    after = facts(broken)
    assert (after.trials, after.expected_s) == (None, None)
    assert "liquids" not in after.steps_s
    assert after.steps_s["delays"] == before.steps_s["delays"]
    assert after.forces_n == before.forces_n
    drowned, _ = study.edited(Set(("liquids", "honey", "density_kg_m3"), -5))
    left = facts(drowned)
    assert set(left.forces_n) == set(before.forces_n) - {"honey"}
    assert left.forces_n["water"] == before.forces_n["water"]
    assert "delays" in left.steps_s
    unlimited, _ = study.edited(Set(("device", "force_limit_n"), 60))
    assert facts(unlimited).forces_n == {}
    assert facts(unlimited).warnings == ()  # those of forces are not known
    assert facts(unlimited).expected_s == before.expected_s


def test_a_question_without_a_sound_id_counts_and_another_fault_leaves_the_question_out() -> None:
    study = study_of("rek2024")
    items = ("questionnaires", "liquid", "items")
    unnamed, _ = study.edited(Unset((*items, 2, "id")))
    assert facts(unnamed).answers == facts(study).answers
    unknown, _ = study.edited(Set((*items, 2, "kind"), "nothing"))
    assert facts(unknown).answers is None
    protocol = valid_part(unknown).protocol
    assert protocol is not None
    whole = valid_part(study).protocol
    assert whole is not None
    assert len(protocol.questionnaires["liquid"].items) == len(whole.questionnaires["liquid"].items) - 1


@pytest.mark.slow
def test_something_can_be_measured_of_every_known_fault() -> None:
    whole = sum(valid_part(read(case.text.encode())).protocol is not None for case in CASES)
    assert whole > 0.95 * len(CASES)
