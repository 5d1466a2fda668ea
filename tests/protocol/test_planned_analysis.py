"""What [analysis] plans of a study with levels: participants, precision and published values."""

import json
from pathlib import Path

import pytest

from study_app.errors import ProtocolError
from study_app.protocol.describe import describe
from study_app.protocol.formats import newer_keys
from study_app.protocol.orders.schedule import draw_key
from study_app.protocol.streams import stream
from study_app.store.blinded.blinding import open_or_draw_key, read_key
from study_app.store.blinded.whole_protocol import whole_protocol
from study_app.store.receipt import without_conditions
from tests.protocol.trials.level_studies import study, text_of

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


def test_the_plan_is_described() -> None:
    said = describe(study(more=PLANNED))
    assert "Participants     20 planned" in said
    assert "Precision        group mean ±15 % (half its 95 % interval)" in said
    assert "viscosity: weber 0.1937, standard 2, at 71 % correct, n = 10, Jones et al. 1997" in said


def test_published_values_are_in_the_key_and_not_in_the_receipt(tmp_path: Path) -> None:
    protocol = study(more=PLANNED)
    shown = without_conditions(protocol)
    assert "0.1937" not in json.dumps(shown)
    assert shown["analysis"]["participants"] == 20
    open_or_draw_key(tmp_path, protocol, random=stream(1, "key").random)
    whole = whole_protocol(shown, read_key(tmp_path))
    assert whole.analysis == protocol.analysis


def test_a_plan_of_format_1_keeps_its_bytes() -> None:
    plan = study(more="\n[analysis]\nalpha = 0.01\n").analysis
    assert plan is not None
    assert set(plan.model_dump(mode="json")).isdisjoint({"participants", "precision", "published"})
    faults = newer_keys({"analysis": {"participants": 20, "published": [{"block": "a"}]}})
    assert [fault.path for fault in faults] == [("analysis", "participants"), ("analysis", "published")]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('block = "viscosity"', 'block = "viscosities"', 'there is no block of levels "viscosities".*viscosity'),
        ("standard = 2", "standard = 9", "the block has no standard 9.*these: 1, 2"),
        ("standard = 2", "low = 0.3", "low, value and high must ascend"),
        ("precision = 0.15", "precision = 0", "precision"),
        ("participants = 20", "participants = 0", "participants"),
        ("percent = 71", "percent = 171", "percent"),
    ],
)
def test_what_is_wrong_is_named(old: str, new: str, said: str) -> None:
    assert draw_key(study(more=PLANNED), stream(1, "key").random)
    with pytest.raises(ProtocolError, match=said):
        study(more=PLANNED.replace(old, new))
    assert old in text_of(more=PLANNED)
