"""What is computed and said of a study: durations, hypotheses, rules, codes, limits and names of methods."""

import hashlib
import math
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from study_app.haptics.model.estimators import Ewma, Kalman, Raw
from study_app.protocol.blocks import Criterion, block_titles, display_language
from study_app.protocol.checks.designs import fitting_rules
from study_app.protocol.descriptions.protocol_text import describe_scenes
from study_app.protocol.file_format.scene_file import with_default_estimator
from study_app.protocol.load import load, parse
from study_app.protocol.model import Analysis, Contrast, ExclusionRule, Published
from study_app.protocol.orders.durations import duration_range_s, expected_duration_s, recordings_of
from study_app.protocol.participants.raters import SimulatedParticipants, compared_kinds
from study_app.protocol.presented.presented_levels import Clipping
from study_app.protocol.randomization.streams import own_code
from study_app.protocol.source.files import has_hash
from study_app.protocol.trials.methods import default_method
from study_app.protocol.trials.stimuli import Stimulus
from study_app.protocol.wording.languages import words
from tests.haptics.scenes import scene
from tests.protocol.groups.grouped import grouped

TIMED = """
format = 2
sequence = ["read", "plain", "compared", "matched", "end"]
study.name = "timed"
liquids.thin.drag = { law = "linear", damping_nspm = 4 }
liquids.thick.drag = { law = "linear", damping_nspm = 7 }
tasks.look = { kind = "explore", min_s = 4, max_s = 10, instruction = "Look." }
tasks.stir = { kind = "follow", amplitude_mm = 10 }
pages.read = { kind = "instructions", title = "Read", body = "BODY" }
pages.rest = { kind = "break", title = "Rest", body = "Now take a rest.", min_s = 40 }
designs.pair = { kind = "2ifc", pause_s = 0.9, between_s = 1.1, feedback_s = 0.7, feedback = "always" }
methods.few = { kind = "constant", levels = [0.2, 0.4], repetitions = 4 }
methods.set = { kind = "adjustment", repetitions = 2, most_s = 20 }
stimuli.damping = { condition = "thin", vary = "damping_nspm", levels = [0.1, 0.6] }
stimuli.matched = { condition = "thin", vary = "damping_nspm", level = "value", levels = [2, 9] }
[questionnaires.short]
intro = "How was it?"
items = [
    { id = "age", text = "How old?", short = "Age", kind = "number" },
    { id = "note", text = "What else?", short = "Note", kind = "text" },
]
[questionnaires.end]
intro = "At the end"
items = [
    { id = "one", text = "First?", short = "First", kind = "number" },
    { id = "two", text = "Second?", short = "Second", kind = "number" },
    { id = "three", text = "Third?", short = "Third", kind = "number" },
]
[blocks.plain]
conditions = ["thin", "thick"]
order = "shuffled"
repetitions = 3
break_every = 2
break_page = "rest"
task = "look"
questionnaire = "short"
[blocks.compared]
stimulus = "damping"
design = "pair"
method = "few"
task = "stir"
[blocks.matched]
stimulus = "matched"
design = "adjustment"
method = "set"
task = "stir"
"""


def test_durations_are_those_of_reading_answering_tasks_pauses_and_breaks() -> None:
    """A page takes 5 s and a third of a second per word, a question 6 s, a choice 2 s, a swing 4 s, a setting 10 s."""
    study = parse(TIMED.replace("BODY", " ".join(["word"] * 30)).encode(), "timed")
    durations_s = {
        "read": 5 + 30 / 3,
        "plain": 6 * (7 + 5 + 2 * 6) + 2 * 40,
        "compared": 8 * (2 * 4 + 0.9 + 2 + 1.1 + 0.7),
        "matched": 2 * (2 * 4 + 0.6 + 10 + 0.8),
        "end": 5 + 3 * 6,
    }
    assert {step: expected_duration_s(study, step) for step in durations_s} == pytest.approx(durations_s)
    total_s = sum(durations_s.values())
    assert expected_duration_s(study) == pytest.approx(total_s)
    assert duration_range_s(study) == pytest.approx((total_s - 6 * 3, total_s + 6 * 3))
    assert list(recordings_of(study)) == [(6, 7.0), (16, 4.0), (4, 14.0)]
    quiet = study.designs["pair"].model_copy(update={"feedback": None})
    silent = study.model_copy(update={"designs": {"pair": quiet}})
    assert expected_duration_s(silent, "compared") == pytest.approx(durations_s["compared"] - 8 * 0.7)


BETWEEN = {"blocks": ("near", "far")}
WITHIN = {"blocks": ("near",), "conditions": ("thin", "thick")}


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        (BETWEEN, "the threshold differs between near and far"),
        (BETWEEN | {"measure": "d_prime", "expected": "lower"}, "sensitivity (d′) is lower in near than in far"),
        (WITHIN | {"measure": "warm", "expected": "higher", "bound": 0.5},
         "agreement with “warm” is higher in thin than in thick in block near, with an equivalence bound of 0.5"),
        (BETWEEN | {"measure": "effort", "form": "load"}, "“effort” (load) differs between near and far"),
        ({"blocks": ("far",), "groups": ("old", "young"), "measure": "pse"},
         "the point of subjective equality differs between old and young in block far"),
        (BETWEEN | {"groups": ("old", "young"), "expected": "higher"},
         "the difference in threshold between near and far is higher in old than in young (interaction)"),
        (WITHIN | {"groups": ("old", "young"), "measure": "exponent", "bound": 2},
         "the difference in exponent between thin and thick in block near differs between old and young (interaction), "
         "with an equivalence bound of 2"),
    ],
)  # fmt: skip
def test_a_hypothesis_names_its_sides_measure_direction_and_bound(keys: dict[str, Any], sentence: str) -> None:
    assert Contrast.model_validate(keys).described() == sentence


def test_a_hypothesis_has_the_names_that_readers_know() -> None:
    contrast = Contrast.model_validate(WITHIN | {"groups": ("old", "young"), "expected": "lower"})
    assert contrast.described(("Old people", "Young"), ("Thin oil", "Thick"), "bias", "Near block") == (
        "the difference in bias between “Thin oil” and Thick in “Near block” is lower in “Old people” than in Young "
        "(interaction)"
    )
    blocks = Contrast.model_validate(BETWEEN)
    assert blocks.words({"near": "thin", "far": "thick"}) == ("near (thin)", "far (thick)")
    for conditions in ({"near": "thin", "far": "thin"}, {"near": "thin", "far": None}, {}):
        assert blocks.words(conditions) == ("near", "far")
    assert contrast.words({"near": "thin"}) == contrast.compared == ("old", "young")
    assert contrast.within == ("thin", "thick")


@pytest.mark.parametrize(
    ("keys", "unit", "text"),
    [
        ({"measure": "weber", "value": 0.1937, "standard": 2, "percent": 71, "n": 10, "source": "Jones 1997"}, "Pa·s",
         "near: Weber fraction 0.1937, standard 2 Pa·s, at 71 % correct, n = 10, Jones 1997"),
        ({"measure": "pse", "value": 3, "n": 4}, "ms", "near: PSE 3 ms, n = 4"),
        ({"measure": "exponent", "value": 0.44, "percent": 50}, "ms", "near: exponent 0.44, at 50 % correct"),
        ({"measure": "threshold", "value": 12.5, "source": "ours"}, "", "near: threshold 12.5, ours"),
    ],
)  # fmt: skip
def test_a_published_value_is_described_with_its_unit_and_source(keys: dict[str, Any], unit: str, text: str) -> None:
    assert Published.model_validate({"block": "near"} | keys).described(unit) == text


def test_rules_of_exclusion_state_their_limits_and_are_offered_where_they_can_apply() -> None:
    rule = ExclusionRule.model_validate({"rule": "constant_answers", "limit": 90.5})
    assert rule.words == "more than 90.5 % of the answers to statements are identical"
    fast = ExclusionRule.model_validate({"rule": "fast_answers", "limit": 0.25})
    assert fast.words == "the median response time is below 0.25 s"
    for name, limit in (("fast_answers", 0.04), ("constant_answers", 101), ("fast_answers", None), ("below_chance", 1)):
        with pytest.raises(ValidationError):
            ExclusionRule.model_validate({"rule": name, "limit": limit})
    assert fitting_rules(load("rek2024")) == ("constant_answers", "fast_answers")
    assert fitting_rules(load("viscosityjnd")) == ("below_chance", "threshold_beyond_levels", "fast_answers")
    assert fitting_rules(load("thickness")) == ("threshold_beyond_levels", "fast_answers")


def test_each_decision_about_the_analysis_has_its_own_row() -> None:
    decided = Analysis.model_validate(
        {
            "alpha": 0.01, "equivalence_bound": 1, "primary": ("warm", "cold"), "names": ("like_oil",),
            "rising": ("late",), "falling": ("calm",), "noticed": "odd", "participants": 30, "precision": 0.15,
            "looks": (10, 30), "spending": "pocock", "exclusions": ({"rule": "fast_answers", "limit": 0.3},),
            "contrasts": (BETWEEN,), "published": ({"block": "near", "measure": "pse", "value": 3},),
        }
    )  # fmt: skip
    of_measure = {"threshold": "just-noticeable difference"}

    def described(decided: Analysis, named_by: list[str], **facts: Any) -> list[tuple[str, str]]:
        return [*decided.described(named_by, measure_text=lambda contrast: of_measure[contrast.measure], **facts)]

    rows = described(decided, ["oil by like_oil"], units={"near": "ms"}, statements=True)
    statements = [
        ("Equivalent", "mean answers within 1 point of those without delay"),
        ("Primary", "warm, cold"),
        ("Recognition", "like_oil"),
        ("Recognised", "oil by like_oil"),
        ("Increase with delay", "late"),
        ("Decrease with delay", "calm"),
        ("Detection", "agreement with odd (5 to 7)"),
    ]
    others = [
        ("Participants", "30 planned"),
        ("Interim analyses", "with 10, 30 participants; Pocock alpha spending"),
        ("Precision", "half-width of the 95 % confidence interval for the group mean: 15 %"),
        ("Proposes exclusion", "the median response time is below 0.3 s"),
        ("Hypothesis", "just-noticeable difference differs between near and far"),
        ("Published", "near: PSE 3 ms"),
    ]
    assert rows == [("Significance level", "0.01"), *statements, *others]
    assert described(decided, [], units={}, statements=False) == [
        rows[0], *others[:-1], ("Published", "near: PSE 3"),
    ]  # fmt: skip
    undecided = dict(described(Analysis(), [], units={}, statements=True))
    assert undecided == {
        "Significance level": "0.05", "Equivalent": "not tested", "Primary": "all statements", "Recognition": "none",
        "Increase with delay": "none", "Decrease with delay": "none", "Detection": "not asked",
    }  # fmt: skip


def test_simulated_participants_are_described_and_compared_with_the_published_kinds() -> None:
    stated = SimulatedParticipants(noise_sd=0.8, bias_sd=0.3, slope_sd=0.6, lapse_rate=0.05)
    spreads = "noise SD 0.8, response bias SD 0.3, slope SD 0.6"
    assert stated.described() == f"{spreads}, lapse rate 0.05"
    assert stated.model_copy(update={"lapse_rate": 0}).described() == spreads
    kinds = compared_kinds(stated)
    assert list(kinds) == ["as in the study file", "consistent", "noisy"]
    assert kinds["as in the study file"] is stated
    typical = compared_kinds(None)
    assert list(typical) == ["typical", "consistent", "noisy"]
    assert [(kind.noise_sd, kind.bias_sd, kind.slope_sd) for kind in typical.values()] == [
        (1.10, 0.76, 0.50), (0.63, 0.50, 0.50), (1.25, 1.00, 0.92),
    ]  # fmt: skip


def test_rows_of_squares_and_groups_of_steps_are_those_of_the_study() -> None:
    study = load("rek2024")
    orders = {"fixed": False, "shuffled": False, "williams": True, "latin": True}
    fixed = {name: block.model_copy(update={"order": "fixed"}) for name, block in study.blocks.items()}
    for order, assigns in orders.items():
        blocks = fixed | {"delays": study.blocks["delays"].model_copy(update={"order": order})}
        assert study.model_copy(update={"blocks": blocks}).assigns_rows == assigns
    for order, assigns in {"fixed": False, "random": False, "balanced": True}.items():
        head = study.study.model_copy(update={"block_order": order})
        assert study.model_copy(update={"study": head, "blocks": fixed}).assigns_rows == assigns
    groups = grouped()
    assert groups.groups_with("end") == ("first_thin",)
    assert groups.groups_with("thin") == ("first_thin", "first_thick")
    assert load("demo").groups_with("liquids") == ()


def test_a_participants_own_codes_are_all_codes_of_the_block() -> None:
    codes = ["L3", "L1", "L2"]
    for block in ("liquids", "delays"):
        own = {
            person: tuple(own_code(codes, bytes(range(32)), f"P{person}", block, code) for code in ("L1", "L2", "L3"))
            for person in range(60)
        }
        assert {tuple(sorted(permuted)) for permuted in own.values()} == {("L1", "L2", "L3")}
        assert len({*own.values()}) == 6


def test_scenes_without_a_study_are_described_with_their_own_numbers() -> None:
    ball_scene = scene(force_limit_n=6.5, rate_hz=2000, scale=4)
    ball = ball_scene.model_copy(update={"body": ball_scene.body.model_copy(update={"diameter_m": 0.07})})
    lines = [" ".join(line.split()) for line in describe_scenes({"water": ball}).splitlines()]
    assert lines[:5] == [
        "Liquids that are not part of a study",
        "Force limit 6.5 N",
        "Servo 2000 Hz",
        "Scale 4 times the hand's motion",
        "Ball 70 mm in the scene (17.5 mm in the hand frame)",
    ]
    for velocity, default in ((Ewma(), Kalman()), (Ewma(alpha=0.2), Ewma(alpha=0.2)), (Raw(), Raw())):
        assert with_default_estimator(ball_scene.model_copy(update={"velocity": velocity})).velocity == default


@pytest.mark.parametrize(
    ("level", "direction", "standard", "limit", "highest", "presented"),
    [
        ("weber", "up", 40.0, 50.0, 0.25, [0.1, 0.25]),
        ("difference", "up", 40.0, 40.2, 0.2, [0.1, 0.2]),
        ("value", "up", None, 0.3, 0.3, [0.1, 0.3]),
        ("weber", "down", 40.0, 50.0, math.inf, [0.1, 0.6]),
        ("weber", "down", 60.0, 50.0, 0.0, [0.0, 0.52]),
    ],
)
def test_clipped_levels_are_those_of_the_limit(
    level: str, direction: str, standard: float | None, limit: float, highest: float, presented: list[float]
) -> None:
    keys = {"vary": "damping_nspm", "level": level, "direction": direction, "levels": (0.1, 0.6)}
    stimulus, clipping = Stimulus.model_validate(keys), Clipping(standard, limit, paced=True)
    assert clipping.highest(stimulus) == pytest.approx(highest)
    assert clipping.clips_standard == (standard == 60.0)
    assert clipping.presented(stimulus, np.array([0.1, 0.6])) == pytest.approx(presented)
    assert clipping.named == ""
    assert Clipping(52.5, limit, paced=True, others=(8.0,)).named == " 52.5"


@pytest.mark.parametrize(
    ("kind", "keys", "name", "target"),
    [
        ("questplus", {}, "QUEST+, which minimises the expected entropy of the threshold (Watson 2017; Prins 2013)",
         "threshold at 75 % right"),
        ("questplus", {"learn": "all"},
         "QUEST+, which minimises the expected entropy of all parameters (Watson 2017)", "threshold at 75 % right"),
        ("updown", {"rule": "3down1up", "ratio": 1.0},
         "weighted up–down tracks (3down1up, steps down 1 times the steps up; García-Pérez 1998) that converge to "
         "79.4 %", "converges to 79.4 % right"),
        ("updown", {"rule": "1down1up", "ratio": 1.0},
         "weighted up–down tracks (1down1up, steps down 1 times the steps up; García-Pérez 1998) that converge to "
         "50.0 %", "converges to 50.0 % right"),
    ],
)  # fmt: skip
def test_methods_are_named_with_their_source_and_the_share_they_converge_to(
    kind: str, keys: dict[str, Any], name: str, target: str
) -> None:
    """With equal steps, three down one up converges to the cube root of a half (Levitt 1971)."""
    method = default_method(kind).model_copy(update=keys)
    assert method.paper_name == name
    assert method.target(0.5, "right") == target


def test_pages_ask_about_unclear_numbers_and_count_missing_questions() -> None:
    english, german = words("en"), words("de")
    for language, reading, other in ((english, "2500", "2.5"), (german, "2500", "2,5")):
        typed = "2,500" if language is english else "2.500"
        prompt = language.unclear_number(f" {typed} ")
        assert [text in prompt for text in (typed, reading, other)] == [True] * 3
        assert language.unclear_number("2500") == ""
    assert english.unclear_number("2.5") == ""
    assert english.questions_missing([3]) != english.missing([3])
    assert "4 and 9" in english.questions_missing([4, 9])
    assert english.questions_missing([4, 9]).startswith("Two questions")
    assert english.questions_missing([3]).startswith("One question ")


def test_a_hash_is_that_of_a_text_with_any_line_ends() -> None:
    unix, windows = b"a = 1\nb = 2\n", b"a = 1\r\nb = 2\r\n"
    for source in (unix, windows):
        for other in (unix, windows):
            assert has_hash(source, hashlib.sha256(other).hexdigest())
        assert not has_hash(source, hashlib.sha256(b"a = 1\nb = 3\n").hexdigest())


def test_titles_of_blocks_are_in_english_if_possible_and_tell_blocks_of_one_phase_apart() -> None:
    blocks = {
        "far": {"phase": "main", "title": {"nl": "Ver", "en": "Oil"}},
        "near": {"phase": "main", "title": {"nl": "Nabij", "en": "Oil"}},
        "warm": {"phase": "practice", "title": {"nl": "Warm", "en": "Oil"}},
    }
    assert block_titles({"study": {"languages": ["nl", "en"]}, "blocks": blocks}) == {
        "far": "Oil (far)", "near": "Oil (near)", "warm": "Oil",
    }  # fmt: skip
    assert block_titles({"study": {"languages": ["nl"]}, "blocks": blocks})["near"] == "Nabij"
    assert display_language({"study": {"languages": ["nl", "de"]}}) == "nl"


def test_a_criterion_may_ask_for_all_answers_and_not_for_more() -> None:
    assert Criterion(right=4, of=4).missed == "go_on"
    with pytest.raises(ValidationError, match="5 of 4 answers cannot be correct"):
        Criterion(right=5, of=4)
