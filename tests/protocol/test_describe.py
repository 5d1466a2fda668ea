"""What [analysis] plans of a study with levels: participants, precision and published values."""

import json
from pathlib import Path

from study_app.protocol.streams import stream
from study_app.store.blinded.blinding import complete_protocol, open_or_draw_key, read_key
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


def test_published_values_are_in_the_key_and_not_in_the_receipt(tmp_path: Path) -> None:
    protocol = study(more=PLANNED)
    shown = without_conditions(protocol)
    assert "0.1937" not in json.dumps(shown)
    assert shown["analysis"]["participants"] == 20
    open_or_draw_key(tmp_path, protocol, random=stream(1, "key").random)
    whole = complete_protocol(shown, read_key(tmp_path))
    assert whole.analysis == protocol.analysis


def test_omitted_keys_of_a_plan_are_not_written() -> None:
    plan = study(more="\n[analysis]\nalpha = 0.01\n").analysis
    assert plan is not None
    assert set(plan.model_dump(mode="json")).isdisjoint({"participants", "precision", "published"})
