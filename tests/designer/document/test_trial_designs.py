"""A block of conditions with a trial design is one step; shipped liquids can be added."""

import pytest

from study_app.designer.document.additions import edits_to_duplicate, edits_to_fill_in, number_rows, repairs
from study_app.designer.document.document import template
from study_app.designer.document.elements import title_of
from study_app.designer.document.fields import kind_note, refused_at, row_at
from study_app.designer.document.steps import (
    AddEntry,
    AddInstrument,
    AddKey,
    AddLiquid,
    ChangeLanguage,
    RemoveKey,
    Request,
    SetValue,
    StepContext,
    shipped_liquids,
)
from study_app.designer.document.study import Study, read_study
from study_app.designer.document.toml_edits import Set
from study_app.designer.form.form import form_of
from study_app.designer.measures.study_facts import facts
from study_app.designer.outline import addable_elements
from study_app.protocol.warnings.study_warnings import warnings
from tests.protocol.trials import matching

STUDY = b"""\
format = 2
study.name = "abx"
sequence = ["feel"]
[liquids.water]
density_kg_m3 = 1001
[liquids.slime]
density_kg_m3 = 1399
[tasks.explore]
kind = "explore"
min_s = 1
max_s = 2
instruction = "Explore the liquid."
[scales.agree]
labels.en = ["1", "2", "3", "4", "5", "6", "7"]
[questionnaires.after]
intro = "What did you feel?"
scale = "agree"
items = [{ id = "thick", text = "It felt thick.", short = "Thick" }]
[conditions.water]
liquid = "water"
[conditions.slime]
liquid = "slime"
[conditions.late]
liquid = "slime"
delay_ms = 80
[blocks.feel]
conditions = ["water", "slime"]
order = "constrained"
max_repeats = 2
repetitions = 4
questionnaire = "after"
"""
DESIGN = ("blocks", "feel", "design")


def after(study: Study, *requests: Request) -> Study:
    for request in requests:
        study, _ = study.with_edits(*request.step(StepContext(study)).edits)
    return study


def warned(study: Study) -> str:
    assert study.protocol is not None
    return "\n".join(warnings(study.protocol))


@pytest.fixture
def study() -> Study:
    read = read_study(STUDY)
    assert read.faults == ()
    return read


@pytest.mark.parametrize("kind", ["abx", "2ifc", "4ifc", "oddity", "samedifferent", "yesno"])
def test_each_design_of_the_list_is_one_step_without_a_problem(study: Study, kind: str) -> None:
    row = row_at(study.document, DESIGN)
    assert row is not None
    assert kind in [choice.value for choice in row.choices]
    assert kind_note(DESIGN, kind).endswith("?")
    whole = after(study, SetValue(DESIGN, kind))
    assert whole.faults == ()
    block = whole.document["blocks"]["feel"]
    assert block["standard"] == "water"
    assert not {"order", "max_repeats", "questionnaire"} & set(block)
    assert whole.document["sequence"] == ("feel", "after"), "the questionnaire comes once, after the block"


def test_a_block_with_a_design_does_not_offer_a_questionnaire_after_each_trial(study: Study) -> None:
    refused = refused_at(after(study, SetValue(DESIGN, "abx")).document, DESIGN[:2])
    assert {"questionnaire", "max_repeats", "min_distance"} <= refused
    wrong = after(study, SetValue(DESIGN, "abx"), SetValue((*DESIGN[:2], "questionnaire"), "after"))
    (fault,) = wrong.faults
    assert fault.kind == "surplus"
    assert fault.message == "cannot be used in a block with a design"
    assert fault.hint == "ask its questions in a form after the block"


def test_a_design_that_is_added_and_removed_again_leaves_no_problem(study: Study) -> None:
    added = after(study, AddKey(DESIGN))
    assert added.faults == ()
    removed = after(added, RemoveKey(DESIGN))
    assert removed.faults == ()
    assert "standard" not in removed.document["blocks"]["feel"]


def test_the_standard_is_one_of_the_blocks_conditions(study: Study) -> None:
    row = row_at(after(study, SetValue(DESIGN, "abx")).document, ("blocks", "feel", "standard"))
    assert row is not None
    assert [choice.value for choice in row.choices] == ["water", "slime"]
    assert not any("^" in bound for bound in row.bounds)


def test_another_standard_is_not_chosen_for_one_that_is_removed(study: Study) -> None:
    whole = after(study, SetValue(DESIGN, "abx"))
    conditions = ("blocks", "feel", "conditions")
    single = after(whole, RemoveKey((*conditions, 0)))
    (fault,) = single.faults
    assert (fault.path, fault.hint) == (conditions, "add another condition")
    assert fault.message == "the block has one condition, but its design compares at least two"
    for pair in (
        after(single, AddEntry(conditions, "late")),
        after(whole, AddEntry(conditions, "late"), RemoveKey((*conditions, 0))),
    ):
        assert pair.document["blocks"]["feel"]["conditions"] == ("slime", "late")
        assert pair.document["blocks"]["feel"]["standard"] == "water"
        (fault,) = pair.faults
        assert (fault.path[-1], [repair.label for repair in repairs(pair, fault)]) == ("standard", ['Use "slime"'])


def test_a_repeated_form_is_counted_each_time_with_and_without_groups() -> None:
    plain = STUDY.replace(b'questionnaire = "after"\n', b"").replace(b'["feel"]', b'["after", "feel", "after"]')
    grouped = plain + b"[groups.experts]\n[groups.novices]\n"
    assert facts(read_study(plain)).answers == facts(read_study(grouped)).answers == 2


def test_another_liquid_and_another_delay_are_warned_of_and_a_drawn_order_is_not(study: Study) -> None:
    good = after(study, SetValue(DESIGN, "abx"))
    assert "in one order" not in warned(good)
    assert "differ in" not in warned(good)
    slip = after(good, SetValue(("blocks", "feel", "conditions"), ["water", "late"]))
    assert "“late” and the standard “water” differ in liquid and visual delay" in warned(slip)


def test_shipped_liquids_are_found_and_added_with_all_their_numbers(study: Study) -> None:
    entries = {entry.label: entry for entry in addable_elements(study, ())}
    slime = entries["Slime liquid, 1020 kg/m³, Maxwell"]
    told_apart = {words for words in entries if words.startswith(("Water liquid", "Damper liquid"))}
    assert told_apart == {
        "Water liquid, 1000 kg/m³, drag, wake", "Water liquid, 998.2 kg/m³, 0.001002 Pa·s",
        "Damper liquid, 4 N·s/m", "Damper liquid, 8 N·s/m",
    }  # fmt: skip
    assert isinstance(slime.asks, AddLiquid)
    assert slime.help.endswith("The scene's scale changes to 3 for all liquids, as in that study.")
    other = after(study, SetValue(("scene", "scale"), 10))
    assert slime.asks.help(other).endswith(
        "The forces differ, because the scene's scale is 3 in that study and 10 in this one."
    )
    assert after(other, slime.asks).document["scene"] == {"scale": 10}
    same = after(study, SetValue(("scene", "scale"), 3))
    assert slime.asks.help(same) == "Copied from the shipped study slime, with all its values"
    added = after(study, slime.asks)
    assert added.faults == ()
    assert added.document["scene"] == {"scale": 3}
    assert "slime_2 is clipped" not in warned(added)
    clipped = warned(after(added, SetValue(("scene", "scale"), 10)))
    assert (
        "force of 17.36 N to 5.30 N, which is more than limits.withheld_percent permits; with scene.scale = 3 it is "
        "not clipped" in clipped
    )
    table = added.document["liquids"]["slime_2"]
    assert dict(table) == dict(shipped_liquids()["slime", "slime"])
    assert added.document["conditions"]["slime_2"] == {"liquid": "slime_2"}
    conditions = form_of(study, ("conditions", "water")).sections[0].rows
    chosen = next(dict(row.additions) for row in conditions if row.path[-1] == "liquid")
    named = after(study, chosen["Slime liquid, 1020 kg/m³, Maxwell"])
    assert (named.faults, named.document["conditions"]["water"]) == ((), {"liquid": "slime_2"})
    assert "New liquid…" in chosen
    (listed,) = form_of(study, ("liquids",)).sections[0].rows
    assert dict(listed.additions)["Slime liquid, 1020 kg/m³, Maxwell"] == slime.asks
    liquids = after(study, dict(listed.additions)["New liquid…"]).document["liquids"]
    assert len(liquids) == len(study.document["liquids"]) + 1
    beside = [entry.label for entry in addable_elements(study, ("liquids", "slime"))]
    assert beside[0] == "Liquid"
    assert {words for words in beside[1:21] if " liquid, " in words} == set(beside[1:21])
    assert "such as water or slime" in entries["Liquid"].help
    assert entries["Question"].help.endswith("; kinds: choice, number, rating, slider, statement, text")
    for source, name in shipped_liquids():
        assert after(study, AddLiquid(source, name)).faults == ()


def test_a_hypothesis_on_a_design_of_conditions_begins_with_d_prime(study: Study) -> None:
    whole = after(study, SetValue(DESIGN, "abx"))
    two, _ = whole.with_edits(*edits_to_duplicate(whole, DESIGN[:2])[0])
    rows = (row for section in form_of(two, ("sequence",)).sections for row in section.rows)
    first, _ = next(row.facts.items for row in rows if row.path == ("analysis", "contrasts"))
    assert first.measures[0] == ("d_prime", "Sensitivity d′")
    assert not {"threshold", "pse", "exponent"} & {measure for measure, _ in first.measures}
    untranslated = after(two, ChangeLanguage("add", "fr"))
    assert untranslated.protocol is None
    rows = (row for section in form_of(untranslated, ("sequence",)).sections for row in section.rows)
    assert next(row.facts.items for row in rows if row.path == ("analysis", "contrasts"))[0].measures == first.measures


def test_numbers_and_scores_of_a_form_are_measures_of_the_block_before_it_but_texts_and_choices_are_not(
    study: Study,
) -> None:
    whole = after(study, SetValue(DESIGN, "abx"))
    two, _ = whole.with_edits(*edits_to_duplicate(whole, DESIGN[:2])[0])
    form = ("questionnaires", "after")
    items = [
        {"id": "thick", "text": "It felt thick.", "short": "Thick"},
        {"id": "weight", "kind": "number", "text": "How heavy was it?", "short": "Weight"},
        {"id": "reason", "kind": "text", "text": "Why?", "short": "Reason"},
        {"id": "hand", "kind": "choice", "text": "Which hand?", "short": "Hand",
         "options": [{"id": "left", "text": "Left"}, {"id": "right", "text": "Right"}]},
    ]  # fmt: skip
    edits = (Set((*form, "items"), items), Set((*form, "scores"), {"effort": {"items": ["thick"]}}))
    study, _ = two.with_edits(*edits, Set(("sequence",), ["feel", "after", "feel_2"]))
    assert study.faults == ()
    rows = (row for section in form_of(study, ("sequence",)).sections for row in section.rows)
    first, last = next(row.facts.items for row in rows if row.path == ("analysis", "contrasts"))
    assert (first.name, last.name, last.measures) == ("feel", "feel_2", (("d_prime", "Sensitivity d′"),))
    assert dict(first.measures) == {
        "d_prime": "Sensitivity d′",
        "after/effort": "Effort score (After)",
        "after/thick": "“Thick” (After)",
        "after/weight": "“Weight” (After)",
    }


@pytest.mark.parametrize(
    ("study", "block", "durations_s", "opened_fields", "sentence"),
    [
        (
            template("viscosity-jnd"),
            "training",
            (4.0, 0.7, 4.0, 2.0, 0.5, 0.9),
            ("Cycles", "Pause", "Cycles", "Question", "Feedback duration", "Between trials"),
            "12.1 s: Interval 4 s, Pause 0.7 s, Interval 4 s, Question about 2 s, Feedback 0.5 s, Between trials 0.9 s",
        ),
        (
            template("viscosity-jnd"),
            "viscosity",
            (4.0, 0.7, 4.0, 2.0, 0.9),
            ("Cycles", "Pause", "Cycles", "Question", "Between trials"),
            "11.6 s: Interval 4 s, Pause 0.7 s, Interval 4 s, Question about 2 s, Between trials 0.9 s",
        ),
        (
            read_study(matching.TEXT.encode()),
            "matching",
            (2.0, 0.7, 2.0, 30.0, 0.9),
            ("Cycles", "Pause", "Cycles", "Maximum duration", "Between trials"),
            "35.6 s: Interval 2 s, Pause 0.7 s, Interval 2 s, Setting about 30 s, Between trials 0.9 s",
        ),
    ],
)
def test_the_trial_strip_has_the_duration_of_each_phase_and_the_label_of_its_field(
    study: Study, block: str, durations_s: tuple[float, ...], opened_fields: tuple[str, ...], sentence: str
) -> None:
    (design,) = study.document["designs"]
    for key, value in {"pause_s": 0.7, "between_s": 0.9, **({"feedback_s": 0.5} if design == "pair" else {})}.items():
        study, _ = study.with_edits(Set(("designs", design, key), value))
    rows = form_of(study, ("blocks", block)).rows
    (strip,) = (row.facts for row in rows if row.path[-1] == "design")
    assert tuple(phase.duration_s for phase in strip.phases) == durations_s
    assert strip.duration_s == pytest.approx(sum(durations_s))
    assert tuple(phase.opens for phase in strip.phases) == opened_fields
    assert strip.sentence == f"One trial takes {sentence}."


EXCLUSION = ("analysis", "exclusions", 0)


def test_an_exclusion_rule_is_one_that_can_apply_and_has_its_usual_limit(study: Study) -> None:
    two = after(study, SetValue(DESIGN, "abx"), AddKey(EXCLUSION[:2]))
    (rule,) = (row for section in form_of(two, EXCLUSION).sections for row in section.rows if row.path[-1] == "rule")
    assert {choice.value: choice.sentence for choice in rule.choices} == {
        "below_chance": "a block has fewer correct answers than expected by chance (binomial p below 0.001)",
        "fast_answers": "the median response time is below “limit” s",
    }
    assert "limit" in refused_at(two.document, EXCLUSION)
    fast = after(two, SetValue((*EXCLUSION, "rule"), "fast_answers"))
    assert fast.faults == ()
    assert dict(fast.document["analysis"]["exclusions"][0]) == {"rule": "fast_answers", "limit": 0.3}
    limit = next(row for row in form_of(fast, EXCLUSION).sections[0].rows if row.path[-1] == "limit")
    assert (limit.unit, limit.permitted) == ("s", "0.05 to 600")
    assert title_of(fast.document, EXCLUSION) == "Fast answers"
    back = after(fast, SetValue((*EXCLUSION, "rule"), "below_chance"))
    assert back.faults == ()
    assert "limit" not in back.document["analysis"]["exclusions"][0]


def test_the_form_of_the_analysis_lists_a_hypothesis_for_each_block(study: Study) -> None:
    copied = after(study, SetValue(DESIGN, "abx"), SetValue(("analysis", "participants"), 16))
    copied, _ = copied.with_edits(*edits_to_duplicate(copied, DESIGN[:2])[0])
    rows = [row for section in form_of(copied, ("analysis",)).sections for row in section.rows]
    assert len(next(row.facts for row in rows if row.path == ("analysis", "contrasts")).items) == 2


def test_a_published_form_without_a_title_in_a_language_has_its_name_as_heading(study: Study) -> None:
    french = after(study, ChangeLanguage("add", "fr"), AddInstrument("nasa-tlx"))
    form = ("questionnaires", "nasa_tlx")
    assert title_of(french.document, form) == "NASA-TLX"
    whole, _ = french.with_edits(*edits_to_fill_in(french, "fr"))
    assert whole.protocol is not None
    assert whole.protocol.questionnaires["nasa_tlx"].title == {"en": "NASA-TLX", "fr": "NASA-TLX"}


def test_a_block_that_becomes_practice_loses_the_keys_of_a_main_block() -> None:
    study = template("viscosity-jnd")
    practised = after(study, SetValue(("blocks", "viscosity", "phase"), "practice"))
    assert [fault.message for fault in practised.faults] == ["there is no main block"]
    assert "code_prefix" not in practised.document["blocks"]["viscosity"]


def test_a_series_of_a_block_varies_its_numbers_or_those_of_its_first_condition() -> None:
    document = template("two-liquids-abx").document
    first, *others = document["blocks"]["liquids"]["conditions"]
    assert others
    varied = [row.path for row in number_rows(document, ("blocks", "liquids"))]
    assert {path[:2] for path in varied} == {("blocks", "liquids"), ("conditions", first)}
    assert ("conditions", first, "delay_ms") in varied
