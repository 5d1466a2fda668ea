"""What [analysis] plans of a study with levels: participants, precision and published values; questions in words."""

import json

import pytest

from study_app.protocol.descriptions.protocol_text import describe
from study_app.protocol.load import parse
from study_app.store.receipt import without_conditions
from tests.protocol.edited_studies import text_of
from tests.protocol.trials.level_studies import study

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


def test_published_values_are_not_in_the_receipt() -> None:
    published = without_conditions(study(more=PLANNED))
    assert "0.1937" not in json.dumps(published)
    assert published["analysis"]["participants"] == 20


def test_omitted_keys_of_a_plan_are_not_written() -> None:
    plan = study(more="\n[analysis]\nalpha = 0.01\n").analysis
    assert plan is not None
    assert set(plan.model_dump(mode="json")).isdisjoint({"participants", "precision", "published"})


@pytest.mark.parametrize(
    ("kind", "rows"),
    [
        ("", "Statements in short, from 1 (a) to 7 (g)|  warm  It is warm.|  cold  It is cold."),
        (
            'kind = "number"\nfrom = 2\nto = 9\nrequired = false',
            "Questions in short|  warm  statement of 7 points  It is warm.|"
            "  cold  number from 2 to 9     It is cold.  (optional)",
        ),
    ],
)
def test_the_kind_of_a_question_is_described_unless_all_are_statements(kind: str, rows: str) -> None:
    text = text_of("sound").replace('id = "cold"', f'id = "cold"\n{kind}')
    assert rows.replace("|", "\n") in describe(parse(text.encode(), "file.toml"))


SHUFFLED = 'order = "shuffled"\nquestionnaire = "feel"'


@pytest.mark.parametrize(
    ("study", "edits", "lines"),
    [
        (
            "session",
            {},
            {
                "Blinding double-blind: the operator does not see the force",
                "Questions 3 statements (questionnaire feel), in the order of the file",
                "Trials 2 trials, a different order for each participant",
            },
        ),
        (
            "session",
            {
                'languages = ["en"]': 'languages = ["en"]\nblinding = "single"',
                "workspace_mm = [100, 60, 60]": "workspace_mm = [130, 70, 50]\nforce_limit_n = 6.5\nrate_hz = 2000",
                'scale = "judged"': 'scale = "judged"\nitem_order = "shuffled"',
            },
            {
                "Blinding single-blind: the operator sees the force and the wake",
                "Force limit 6.5 N",
                "Servo 2000 Hz",
                "Tank 130 × 70 × 50 mm in the hand frame, 10 times as large in the scene",
                "Questions 3 statements (questionnaire feel), in a new order each time",
            },
        ),
        (
            "session",
            {
                SHUFFLED: f"{SHUFFLED.replace('shuffled', 'constrained')}\nrepetitions = 4\nmax_repeats = 3\n"
                'min_distance = 2\nbreak_page = "rest"\nbreak_every = 3',
                "[pages.thanks]": '[pages.rest]\nkind = "break"\ntitle = "Rest"\nbody = "Rest."\n[pages.thanks]',
            },
            {
                "Trials 8 trials, each condition 4 times, a different order for each participant, with each condition "
                "at most 3 times in a row and at least 2 trials from one presentation of a condition to the next",
                "Breaks 2, after every 3 trials: Rest",
            },
        ),
        (
            "levels",
            {"standards = [1, 2]": "standards = [1, 2.5]"},
            {
                "Design 2IFC of viscosity_pa_s, standards 1, 2.5 Pa·s: 2 intervals, 0.6 s apart",
                "Levels Weber fraction 0.2 to 0.8 (constant: 3 levels, 8 presentations each), 24 trials per standard",
                "Comparisons viscosity_pa_s 1.2 to 4.5 Pa·s",
            },
        ),
        (
            "levels",
            {
                'design = "2ifc"': 'design = "pair"\nuntil = { right = 8, of = 10 }',
                "[methods.few]": '[designs.pair]\nkind = "2ifc"\nfeedback = "always"\n[methods.few]',
            },
            {
                "Ends early as soon as 8 of the last 10 answers are correct; if this never happens, the session "
                "continues after the last trial",
                "Feedback after every trial",
            },
        ),
        (  # the pace is 2π · 20 mm · 1 Hz
            "matching",
            {"levels = [2, 18]": "levels = [3, 15]"},
            {
                "Levels value 3 to 15 N·s/m (adjustment), 4 trials per standard",
                "Comparisons damping_nspm 3 to 15 N·s/m",
                "Force at the paced speed 0.4 to 1.9 N at 0.126 m/s, and at most 2.3 N at 1.2 times that speed",
            },
        ),
        (
            "every_design",
            {
                'design = "estimation"': 'design = "guess"',
                "[stimuli.around]": '[designs.guess]\nkind = "estimation"\nmodulus = { level = 2, number = 40 }\n'
                "[stimuli.around]",
            },
            {
                "Levels value 0.5 to 8 Pa·s (constant: 5 levels, 1 presentation each), 6 trials",
                "Modulus the number 40 for 2 Pa·s, presented in the first trial, which is not analysed",
            },
        ),
        (
            "grouped",
            {
                'study.name = "grouped"': 'study.name = "grouped"\nstudy.description = """\nIs honey\nheavier?\n"""',
                "[groups.first_thin]": "[groups.first_thin]\nshare = 2",
                "[groups.first_thick]": "[groups.first_thick]\nshare = 3",
            },
            {
                "Description Is honey heavier?",
                "Group first_thin, share 2",
                "Group first_thick, share 3",
                "Answers 6 to 7 per session",
                "Questions 1 statement (questionnaire judgement)",
            },
        ),
        (
            "grouped",
            {
                'short = "Heavy" }': 'short = "Heavy" },\n{ id = "why", kind = "text", text = "Why?", short = "Why", '
                'show_if = { item = "heavy", at_least = 5 } }'
            },
            {"Answers up to 13 per session", "Group first_thick (about 2 min, up to 12 answers)"},
        ),
    ],
)
def test_each_row_states_its_own_value(study: str, edits: dict[str, str], lines: set[str]) -> None:
    text = text_of(study)
    for old, new in edits.items():
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    description = describe(parse(text.encode(), "file.toml"))
    assert lines - {" ".join(line.split()) for line in description.splitlines()} == set()
