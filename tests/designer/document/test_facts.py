"""Repairs of faults, numbers that follow every edit, and levels as limits clip them."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from study_app.analysis.planning import threshold_studies
from study_app.designer.document.additions import repairs
from study_app.designer.document.document import template
from study_app.designer.document.elements import outline
from study_app.designer.document.steps import AddElement, AddInstrument, AddKey, ChangeLanguage, StepContext
from study_app.designer.document.study import Study, read_study
from study_app.designer.document.toml_edits import Set, Unset
from study_app.designer.measures.study_facts import facts, revealing_texts, text_keys, texts_by_language, valid_part
from study_app.haptics.model.slope_limits import slope_limit
from study_app.protocol.descriptions.protocol_text import describe
from study_app.protocol.load import load
from study_app.protocol.orders import block_balance
from study_app.protocol.orders.durations import duration_range_s, expected_duration_s
from study_app.protocol.orders.schedule import FormStep, Trial, build_schedule
from study_app.protocol.presented.presented_levels import LevelLimits, clipping, level_limits, levels, standard_level
from study_app.protocol.source.document import Places, value_at
from study_app.protocol.source.files import shipped, shipped_file
from study_app.protocol.warnings.expected_precision import ThresholdPlan, expected, threshold_plan
from tests.designer.document.grown import PROTOCOLS
from tests.protocol.edited_studies import FAULTY, FILES, Case, cases_of


def study_of(name: str, *changes: tuple[str, str]) -> Study:
    text = (PROTOCOLS / f"{name}.toml").read_text(encoding="utf-8")
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return read_study(text.encode(), PROTOCOLS)


@pytest.mark.slow
def test_each_repair_of_the_known_faults_removes_its_fault() -> None:
    repaired = {case.name for case in FAULTY if _repaired(case)}
    assert len(repaired) >= 30, sorted(repaired)


def test_surplus_keys_are_removed_by_a_repair() -> None:
    studies = [(case, read_study(case.text.encode())) for file in FILES for case in cases_of(file)]
    surplus = [(study, fault, case) for case, study in studies for fault in study.faults if fault.kind == "surplus"]
    assert len({fault.message for _, fault, _ in surplus}) > 15
    for study, fault, case in surplus:
        assert not re.search(r"\bomit|\bremove\b", f"{fault.message} {fault.hint}"), case.name
        assert "Remove" in [repair.label for repair in repairs(study, fault)], (case.name, fault)
        assert str(fault.located(Places.of(study.text))).endswith("remove it)")
    for case, study in studies:
        assert not [fault for fault in study.faults if "omit" in f"{fault.message} {fault.hint}"], case.name


def _repaired(case: Case) -> int:
    study = read_study(case.text.encode())
    count = 0
    for fault in study.faults:
        for repair in repairs(study, fault):
            after, _ = study.with_edits(*repair.edits)
            assert (fault.path, fault.message) not in {
                (remaining.path, remaining.message) for remaining in after.faults
            }
            count += 1
    return count


@pytest.mark.slow
@pytest.mark.parametrize(
    ("standard", "frequency_hz", "limit", "most"),
    [(40, 1.0, "the slope limit", 0.324), (30, 1.3, "device.force_limit_n", 0.36)],
)
def test_the_highest_level_includes_fixed_levels(standard: float, frequency_hz: float, limit: str, most: float) -> None:
    edits = Set(("stimuli", "damping", "standards"), [standard]), Set(("tasks", "stir", "frequency_hz"), frequency_hz)
    study, _ = template("viscosity-jnd").with_edits(*edits)
    (fault,) = study.faults  # one for both blocks
    assert limit in fault.message
    (repair,) = repairs(study, fault)
    assert repair.label == f"Highest level {most:g}"
    after, _ = study.with_edits(*repair.edits)
    assert after.document["stimuli"]["damping"]["levels"] == (0.02, most)
    assert after.document["methods"]["easy"]["levels"] == (most,)


def test_a_fault_of_a_table_that_two_blocks_name_counts_once() -> None:
    changes = Set(("stimuli", "damping", "level"), "value"), Set(("stimuli", "damping", "levels"), [9, 40])
    study, _ = template("viscosity-jnd").with_edits(*changes, Set(("methods", "easy", "levels"), [12]))
    assert [fault.path for fault in study.faults].count(("designs", "pair", "feedback")) == 1


def test_a_fault_of_a_question_counts_once_at_its_block() -> None:
    study, _ = study_of("demo").with_edits(Set(("questionnaires", "liquid", "items", 0, "text"), 3))
    assert len(study.faults) == 1
    counts = {element.path: element.faults for element in outline(study).session if element.faults}
    assert counts[("blocks", "liquids")] == counts[("questionnaires", "liquid")] == 1


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped())
def test_facts_agree_with_the_session_and_with_check(name: str) -> None:
    study = study_of(name)
    assert study.protocol is not None
    study_facts = facts(study)
    steps = build_schedule(study.protocol, "P001", 1).steps
    assert study_facts.trials == sum(isinstance(step, Trial) for step in steps)
    assert study_facts.answers == sum(
        len(step.items)
        for step in steps
        if isinstance(step, FormStep) or (isinstance(step, Trial) and step.phase == "main")
    )
    assert study_facts.expected_s == pytest.approx(sum(study_facts.steps_s.values()))
    words = describe(study.protocol)
    assert f"about {study_facts.expected_s / 60:.0f} min" in words
    assert all(warning in words for warning in study_facts.warnings)
    assert set(study_facts.forces_n) == set(study.protocol.liquids)
    assert study_facts.missing == {}


def test_levels_state_the_limit_that_clips_them() -> None:
    protocol = load("viscosityjnd")
    slow = protocol.device.model_copy(update={"rate_hz": 500.0})
    weak = protocol.device.model_copy(update={"force_limit_n": 2.0})
    by = {
        device: {level.clipped_by for level in levels(protocol.model_copy(update={"device": settings}), "viscosity")}
        for device, settings in (("slow", slow), ("weak", weak))
    }
    assert "slope" in by["slow"]
    assert "norm" in by["weak"]
    clipped = [level for level in levels(protocol.model_copy(update={"device": weak}), "viscosity") if level.clipped_by]
    assert all(level.asked_n > level.sent_n == 2.0 for level in clipped)  # type: ignore[operator]
    assert levels(load("demo"), "liquids") == ()


@pytest.mark.parametrize(("name", "block"), [("viscosityjnd", "viscosity"), ("thickness", "thickness")])
def test_a_limit_begins_where_levels_begin_to_be_clipped(name: str, block: str) -> None:
    protocol = load(name)
    limits = level_limits(protocol, protocol.blocks[block])
    assert limits is not None
    assert limits.force is not None
    assert limits.loop is not None
    first = min(limits.force, limits.loop)
    assert standard_level(protocol, block, 0.999 * first).clipped_by is None
    assert standard_level(protocol, block, 1.001 * first).clipped_by is not None
    force = standard_level(protocol, block, limits.force).asked_n
    assert force == pytest.approx(protocol.device.force_limit_n, rel=1e-3)
    if name == "viscosityjnd":
        loop = slope_limit(1 / protocol.device.rate_hz, 1, protocol.scene.velocity)
        assert limits.loop == pytest.approx(loop, rel=1e-4)


def test_a_study_with_clipped_levels_still_has_its_numbers() -> None:
    clipped, _ = study_of("viscosityjnd").with_edits(Set(("stimuli", "damping", "levels"), [0.02, 3]))
    assert clipped.protocol is None
    assert clipped.formed is not None
    assert facts(clipped).trials
    assert any(level.clipped_by for level in levels(clipped.formed, "viscosity"))
    broken, _ = clipped.with_edits(Set(("study", "version"), 3))
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
    lacking, _ = study.with_edits(Unset(("blocks", "liquids", "title", "nl")))
    assert texts_by_language(lacking)["nl"] == (wanted - 1, wanted)
    (labels, _), plain = texts_by_language(study)["nl"], Set(("blocks", "liquids", "title"), "Hi")
    without, _ = study.with_edits(Unset(("scales", "agreement", "labels", "nl")), plain)
    assert texts_by_language(without) == {"en": (wanted, wanted), "nl": (labels - 2, wanted)}
    assert facts(without).missing == {"nl": 2}
    assert {"title", "body", "setting_label", "instruction"} <= text_keys()


def test_blocks_with_one_title_are_named_once_whatever_the_number_of_languages() -> None:
    title = {"en": "A common title", "nl": "Eén titel"}
    study, _ = study_of("rek2024").with_edits(
        *(Set(("blocks", block, "title"), title) for block in ("liquids", "delays"))
    )
    (warning,) = [sentence for sentence in facts(study).warnings if "same title" in sentence]
    assert warning.startswith("blocks.delays.title: block liquids has the same title, “A common title”")


def test_a_viscosity_beside_another_law_is_a_problem_of_its_field_and_can_be_removed() -> None:
    liquid = ("liquids", "thin")
    study = template("two-liquids-abx")
    assert value_at(study.document, (*liquid, "viscosity_pa_s")) == 0.2
    study, _ = study.with_edits(*AddKey((*liquid, "non_newtonian")).step(StepContext(study)).edits)
    (fault,) = study.faults
    message = "describes a Newtonian liquid, but the non-Newtonian table specifies another law"
    assert (fault.path, fault.message) == ((*liquid, "viscosity_pa_s"), message)
    (repair,) = repairs(study, fault)
    assert repair.label == "Remove"
    assert study.with_edits(*repair.edits)[0].faults == ()
    without, _ = study.with_edits(*repair.edits, Unset((*liquid, "non_newtonian", "kind")))
    kinds = '"herschel-bulkley", "carreau", "maxwell", "shear-thickening"'
    assert [fault.hint for fault in without.faults] == [f"one of {kinds}"]


def test_a_study_gets_two_groups_at_once() -> None:
    study, _ = template("two-liquids-abx").with_edits(Set(("study", "group_assignment"), "pre-existing"))
    (fault,) = study.faults
    add, remove = repairs(study, fault)
    assert (add.label, remove.label) == ("Add two groups", "Remove")
    grouped, _ = study.with_edits(*add.edits)
    assert (grouped.faults, len(grouped.document["groups"])) == ((), 2)
    single, _ = grouped.with_edits(Unset(("groups", "group")))
    (fault,) = single.faults
    again = repairs(single, fault)[0]
    assert again.label == "Add another group"
    assert single.with_edits(*again.edits)[0].document["groups"].keys() == {"group", "group_2"}
    step = AddElement(("groups",)).step(StepContext(template("two-liquids-abx")))
    assert (step.select, template("two-liquids-abx").with_edits(*step.edits)[0].faults) == (("groups", "group"), ())


def test_texts_that_the_program_lacks_in_a_language_are_missing_and_each_is_a_problem() -> None:
    study = template("two-liquids-abx")
    for request in (ChangeLanguage("add", "fr"), ChangeLanguage("copy", "fr"), AddInstrument("nasa-tlx")):
        study, _ = study.with_edits(*request.step(StepContext(study)).edits)
    assert facts(study).missing == {"fr": 1 + 6 * 3}, "the introduction, and of each item its text and two ends"
    assert [fault.kind for fault in study.faults] == ["no text"] * 19


@pytest.mark.parametrize(("text", "word"), [("Now comes Light Oil", "light oil"), ("Seen 50 ms late", "50 ms")])
def test_a_text_that_reveals_the_comparison_is_found(text: str, word: str) -> None:
    study = study_of("rek2024")
    assert study.protocol is not None
    assert revealing_texts(study, study.protocol) == ()
    changed, _ = study.with_edits(Set(("blocks", "liquids", "setting_label", "en"), text))
    assert changed.protocol is not None
    (revealing,) = revealing_texts(changed, changed.protocol)
    assert (revealing.path, revealing.word) == (("blocks", "liquids", "setting_label"), word)


def test_an_order_is_even_at_full_rounds_of_its_square() -> None:
    protocol = load("physical2")
    even, uneven = block_balance(protocol, "liquids", 12), block_balance(protocol, "liquids", 13)
    assert even is not None
    assert uneven is not None
    assert (even.rows, even.evenness.balanced) == (6, True)
    assert (uneven.rows, uneven.evenness.balanced) == (6, False)
    assert block_balance(protocol, "practice", 12) is None


def test_numbers_continue_while_a_text_is_missing() -> None:
    study = study_of("rek2024")
    lacking, _ = study.with_edits(Unset(("blocks", "liquids", "title", "nl")), Set(("study", "version"), 3))
    assert lacking.formed is None
    before, after = facts(study), facts(lacking)
    assert (after.trials, after.answers, after.expected_s) == (before.trials, before.answers, before.expected_s)
    assert after.missing == {"nl": 1}


@pytest.mark.slow
def test_numbers_that_depend_on_a_broken_element_are_not_known() -> None:
    study = study_of("rek2024")
    before = facts(study)
    broken, _ = study.with_edits(Set(("blocks", "liquids", "repetitions"), -1))
    after = facts(broken)
    assert (after.trials, after.expected_s) == (None, None)
    assert "liquids" not in after.steps_s
    assert after.steps_s["delays"] == before.steps_s["delays"]
    assert after.forces_n == before.forces_n
    drowned, _ = study.with_edits(Set(("liquids", "honey", "density_kg_m3"), -5))
    left = facts(drowned)
    assert set(left.forces_n) == set(before.forces_n) - {"honey"}
    assert left.forces_n["water"] == before.forces_n["water"]
    assert "delays" in left.steps_s
    unlimited, _ = study.with_edits(Set(("device", "force_limit_n"), 60))
    assert facts(unlimited).forces_n == {}
    assert facts(unlimited).warnings == ()  # those of forces are not known
    assert facts(unlimited).expected_s == before.expected_s


def test_a_question_without_a_sound_id_counts_and_another_fault_leaves_the_question_out() -> None:
    study = study_of("rek2024")
    items = ("questionnaires", "liquid", "items")
    unnamed, _ = study.with_edits(Unset((*items, 2, "id")))
    assert facts(unnamed).answers == facts(study).answers
    unknown, _ = study.with_edits(Set((*items, 2, "kind"), "nothing"))
    assert facts(unknown).answers is None
    protocol = valid_part(unknown).protocol
    assert protocol is not None
    whole = valid_part(study).protocol
    assert whole is not None
    assert len(protocol.questionnaires["liquid"].items) == len(whole.questionnaires["liquid"].items) - 1


@pytest.mark.slow
def test_something_can_be_measured_of_every_known_fault() -> None:
    whole = sum(valid_part(read_study(case.text.encode())).protocol is not None for case in FAULTY)
    assert whole > 0.95 * len(FAULTY)


CLIPPED = Set(("stimuli", "damping", "standards"), [32]), Set(("stimuli", "damping", "levels"), [0.02, 2.0])
FULL = 53 / 32 - 1
"""The highest level of these that is presented in full: the slope limit of the loop is 53 N·s/m."""


def plan_of(trials: int = 40, *changes: Set) -> ThresholdPlan:
    protocol = template("viscosity-jnd").with_edits(*changes)[0].formed
    assert protocol is not None
    plan = threshold_plan(protocol, protocol.blocks["viscosity"])
    assert plan is not None
    return plan.with_trials(trials)


@pytest.mark.parametrize(
    ("changes", "levels_requested", "presented"),
    [
        (CLIPPED, [0.02, 0.6, 0.7, 2.0], [0.02, 0.6, FULL, FULL]),
        ((*CLIPPED[:1], Set(("stimuli", "damping", "levels"), [0.02, 0.6])), [0.6], [0.6]),
        ((Set(("stimuli", "damping", "standards"), [60]),), [0.1, 0.6], [0.0, 0.0]),
        (
            (Set(("stimuli", "damping", "standards"), [60]), Set(("stimuli", "damping", "direction"), "down")),
            [0.05, 0.5],
            [0.0, (53 - 30) / 53],
        ),
    ],
)
def test_levels_are_presented_as_the_limits_leave_them(
    changes: tuple[Set, ...], levels_requested: list[float], presented: list[float]
) -> None:
    plan = plan_of(40, *changes)
    levels_shown = 10.0 ** plan.presented(np.log10(levels_requested))
    assert levels_shown.tolist() == pytest.approx(presented, rel=1e-6)


def test_no_clipped_level_is_a_threshold_that_can_be_measured() -> None:
    free = {"kind": "explore", "min_s": 2, "max_s": 4, "instruction": "Feel."}
    unpaced = CLIPPED[1], Set(("tasks", "stir"), free), Set(("stimuli", "damping", "standards"), [12])
    for changes, most in ((CLIPPED, FULL), (unpaced, 8 / 0.3 / 12 - 1)):
        protocol = template("viscosity-jnd").with_edits(*changes)[0].formed
        assert protocol is not None
        plan = threshold_plan(protocol, protocol.blocks["viscosity"])
        assert plan is not None
        clips = clipping(protocol, protocol.blocks["viscosity"])
        assert clips is not None
        assert clips.highest(plan.stimulus) == pytest.approx(most, rel=1e-4)
        assert (plan.clipping is None) == (changes is unpaced)  # fast motions are repeated, not answered
    limits = LevelLimits(force=None, loop=40.0, hand_mps=0.1)
    known = clipping(protocol, protocol.blocks["viscosity"], limits)
    assert known is not None
    assert known.limit == 40.0  # limits that are known are not looked for again
    down = Set(("stimuli", "damping", "standards"), [60]), Set(("stimuli", "damping", "direction"), "down")
    assert not plan_of(4, *down).measures(np.array(-1.0))  # the standard itself is clipped


def test_no_level_of_a_late_force_is_clipped_though_a_limit_clips_the_force() -> None:
    protocol = (
        read_study(shipped_file("forcedelay").read_bytes()).with_edits(Set(("device", "force_limit_n"), 0.1))[0].formed
    )
    assert protocol is not None
    assert clipping(protocol, protocol.blocks["delay"]) is None


@pytest.mark.slow
@pytest.mark.parametrize("standard", [52, 60])
def test_a_threshold_whose_levels_are_clipped_has_no_precision(standard: float) -> None:
    plan = plan_of(24, Set(("stimuli", "damping", "standards"), [standard]))
    known = expected(plan)
    assert known is not None
    assert not known.measured
    assert (known.participants_for(0.15), known.trials_for(0.15, 12)) == (None, None)
    estimates = threshold_studies.study_batch(threshold_studies.Case("viscosity", plan, (1,)), (12,))
    assert estimates.within(0, 100.0) == 0.0
    assert math.isinf(estimates.spread)
    full = threshold_studies.study_batch(threshold_studies.Case("viscosity", replace(plan, clipping=None), (1,)), (12,))
    assert full.within(0, 100.0) == 1.0


@pytest.mark.slow
def test_each_standard_is_simulated_as_limits_clip_it() -> None:
    plan = plan_of(24, Set(("stimuli", "damping", "standards"), [8, 32]), CLIPPED[1])
    levels_requested = np.log10([0.02, 0.6, 2.0])
    high, low = (10.0 ** standard_plan.presented(levels_requested) for standard_plan in plan.each_standard())
    assert high.tolist() == pytest.approx([0.02, 0.6, FULL], rel=1e-6)
    assert low.tolist() == pytest.approx([0.02, 0.6, 2.0])
    assert plan.clipping is not None
    all_as_the_highest = replace(plan, clipping=replace(plan.clipping, others=()))
    own, same = expected(plan), expected(all_as_the_highest)
    assert own is not None
    assert same is not None
    assert own.spread < 0.95 * same.spread
    studies = (
        threshold_studies.study_batch(threshold_studies.Case("viscosity", case_plan, (1,)), (20,))
        for case_plan in (plan, all_as_the_highest)
    )
    own_errors, same_errors = (np.concatenate(batch.errors) for batch in studies)
    assert own_errors[:, 1].std() < 0.9 * same_errors[:, 1].std()
