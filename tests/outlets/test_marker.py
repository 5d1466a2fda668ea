"""Markers carry codes and counts by a list, and nothing else that an event says."""

import json

import pytest

from study_app.outlets.marker import CODES, marker_of
from study_app.store.journals.journal_events import EVENT_NAMES

ORIGIN_NS = 5_000_000_000
TRIAL = {"trial": 3, "attempt": 1, "block": "liquids", "phase": "main", "part": 1, "index": 2, "of": 4, "code": "L2"}


def test_a_marker_says_what_happened_where_and_when() -> None:
    marker = marker_of("trial_started", 12.3456789, ORIGIN_NS, TRIAL)
    assert marker is not None
    assert marker.time_ns == ORIGIN_NS + 12_345_678_900
    said = {"trial": 3, "attempt": 1, "block": "liquids", "phase": "main", "code": "L2"}
    assert json.loads(marker.text) == {"event": "trial_started", **said, "t_s": 12.345679, "trigger": 10}
    assert "\n" not in marker.text


@pytest.mark.parametrize(
    ("event", "fields"),
    [
        (
            "trial_started",
            TRIAL | {"sealed": "gAAAAB", "level": 1.7, "standard": 2, "arrangement": "AB", "catch": True},
        ),
        ("trial_ended", {"trial": 3, "attempt": 1, "outcome": "complete", "force_peak_n": 4.2, "sealed": "gAAAAB"}),
        ("interval_ended", {"trial": 3, "attempt": 1, "interval": 2, "invalid": ["level_error"], "outcome": "timeout"}),
        ("choice", {"trial": 3, "item": "wet", "value": 6}),
        ("note", {"kind": "note", "text": "this must be honey"}),
        ("broke", {"what": "the device 'falcon' stopped"}),
        ("session_started", {"participant": "P007", "seed": 7, "operator": "AK", "limits": {"lateness_ms": 2.0}}),
    ],
)
def test_a_marker_holds_no_answer_measure_text_or_sealed_field(event: str, fields: dict[str, object]) -> None:
    marker = marker_of(event, 1.0, 0, fields)
    assert marker is not None
    assert set(json.loads(marker.text)) <= {"event", "t_s", "trigger", *TRIAL, "interval", "item"} - {"part", "of"}


def test_codes_are_bytes_of_events_of_the_journal_and_differ() -> None:
    assert set(CODES) <= EVENT_NAMES
    assert len(set(CODES.values())) == len(CODES)
    assert all(1 <= code <= 255 for code in CODES.values())


def test_what_concerns_the_results_folder_alone_is_no_marker() -> None:
    assert marker_of("recorded", 1.0, 0, {"trial": 1}) is None
    assert marker_of("preflight", 1.0, 0, {"checks": []}) is None
