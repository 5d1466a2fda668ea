"""Warnings about hypotheses that the planned study cannot answer."""

import pytest

from study_app.protocol.load import parse
from study_app.protocol.warnings import warnings

STATEMENTS = """
format = 2
study.name = "two"
liquids.honey.drag = { law = "linear", damping_nspm = 8 }
liquids.water.drag = { law = "linear", damping_nspm = 1 }
conditions.honey.liquid = "honey"
conditions.water.liquid = "water"
tasks.stir.kind = "follow"
groups = { old = { share = 2 }, new = {} }
scales.agreement.labels.en = ["1", "2", "3", "4", "5", "6", "7"]
questionnaires.after = { intro = "How was it?", scale = "agreement", items = [
  { id = "thick", text = "It was thick.", short = "Thick" },
  { id = "calm", kind = "slider", text = "How calm?", short = "Calm", low = "not", high = "very" },
] }
blocks.b = { conditions = ["honey", "water"], questionnaire = "after", task = "stir", order = "shuffled" }
"""
SIDES = 'blocks = ["b"], conditions = ["honey", "water"]'


def warnings_of(text: str, place: str) -> list[str]:
    """Return the warnings about a place in a study."""
    return [
        sentence.removeprefix(place) for sentence in warnings(parse(text.encode(), "two.toml")) if place in sentence
    ]


@pytest.mark.parametrize(
    ("participants", "contrasts", "fewest"),
    [
        # log 0.05 / log(1 − 1/6) = 16.4: nobody of the sixth of people who differ by 6 points
        (16, [f'measure = "thick", {SIDES}, bound = 1'], ["at least 17 participants, but 16"]),
        (17, [f'measure = "thick", {SIDES}, bound = 1'], [""]),
        # any minority of up to a fifth counts for other questions: log 0.05 / log 0.8 = 13.4
        (13, [f'measure = "calm", {SIDES}, bound = 8'], ["at least 14 participants, but 13"]),
        (14, [f'measure = "calm", {SIDES}, bound = 8'], [""]),
        # two bounds are tested at 0.025: log 0.025 / log 0.8 = 16.5; a third of 49 people is in the group "new"
        (
            49,
            [
                'measure = "calm", blocks = ["b"], groups = ["old", "new"], bound = 8',
                f'measure = "thick", {SIDES}',
                f'measure = "calm", {SIDES}, bound = 9',
            ],
            ["at least 17 participants in each group, but 16", "", ""],
        ),
        # an interaction of statements can differ by 12 points: log 0.05 / log(1 − 2/12) = 16.4
        (
            45,
            [f'measure = "thick", {SIDES}, groups = ["old", "new"], bound = 2'],
            ["at least 17 participants in each group, but 15"],
        ),
    ],
)
def test_a_bound_needs_enough_planned_participants(participants: int, contrasts: list[str], fewest: list[str]) -> None:
    stated = ", ".join(f"{{ {table} }}" for table in contrasts)
    text = f"{STATEMENTS}analysis = {{ participants = {participants}, contrasts = [{stated}] }}"
    expected = [[f"equivalence within this bound requires {words} are planned"] if words else [] for words in fewest]
    for number, sentences in enumerate(expected, start=1):
        assert warnings_of(text, f"analysis.contrasts.{number}.bound: ") == sentences


LEVELS = """
format = 2
study = { name = "two", block_order = "balanced" }
liquids.damper.drag = { law = "linear", damping_nspm = 8 }
tasks.stir.kind = "follow"
stimuli.damping = { vary = "damping_nspm", levels = [0.02, 0.6], standards = [4, 10] }
methods.m = { kind = "questplus", trials = 30 }
blocks.both = { stimulus = "damping", design = "2ifc", method = "m", task = "stir" }
blocks.other = { stimulus = "damping", design = "2ifc", method = "m", task = "stir", standards = [4] }
analysis = { participants = 8, contrasts = [{ measure = "threshold", blocks = ["both", "other"] }] }
"""


@pytest.mark.parametrize(
    ("change", "standards"),
    [
        (("standards = [4] }", "standards = [4] }"), "both at 4, 10 and other at 4"),
        (("standards = [4] }", "standards = [10, 4] }"), ""),
        (('"m", task = "stir" }', '"m", task = "stir", standards = [10] }'), ""),  # thresholds at two standards
        (('measure = "threshold"', 'measure = "d_prime"'), ""),
    ],
)
def test_values_at_different_standards_are_not_compared_silently(change: tuple[str, str], standards: str) -> None:
    text = LEVELS.replace(*change, 1)
    sentence = (
        f"the blocks have different standards ({standards}), so the difference between them is confounded with the "
        "standard; use the same standards"
    )
    assert warnings_of(text, "analysis.contrasts.1: ") == ([sentence] if standards else [])


def test_a_trend_with_the_delay_is_not_tested_where_liquids_are_compared() -> None:
    (sentence,) = warnings_of(f'{STATEMENTS}analysis = {{ rising = ["thick"] }}', "analysis.rising")
    assert "the trend in thick is not tested" in sentence
    late = STATEMENTS.replace(
        'conditions.water.liquid = "water"', 'conditions.water = { liquid = "honey", delay_ms = 90 }'
    )
    assert not warnings_of(f'{late}analysis = {{ rising = ["thick"] }}', "analysis.rising")
