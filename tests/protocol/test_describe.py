"""What [analysis] plans of a study with levels: participants, precision and published values."""

import json

from study_app.store.receipt import without_conditions
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
