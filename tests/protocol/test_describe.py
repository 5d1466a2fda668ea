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
    shown = without_conditions(study(more=PLANNED))
    assert "0.1937" not in json.dumps(shown)
    assert shown["analysis"]["participants"] == 20


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
def test_the_kind_of_a_question_is_told_unless_all_are_statements(kind: str, rows: str) -> None:
    text = text_of("sound").replace('id = "cold"', f'id = "cold"\n{kind}')
    assert rows.replace("|", "\n") in describe(parse(text.encode(), "file.toml"))
