"""The scanner of states: it agrees with the standard library on what JSON is, and finds the numbers."""

import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.devices.inverse3.wire import (
    BUTTON,
    BUTTONS,
    CALIBRATED,
    NO_DEVICE,
    NOT_FINITE,
    NOT_JSON,
    POSITION,
    READY,
    SCAN,
    UNDERSTOOD,
    VELOCITY,
    WITHOUT_POSITION,
    scan,
    text_hash,
)
from study_app.haptics.model.layout import records
from tests.compiled import wraps

pytestmark = wraps

OWN = "049D"
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-(10**20), 10**20) | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=12,
)  # fmt: skip


def scanned(text: str | bytes, own: str = OWN) -> tuple[int, Any]:
    record = records(SCAN, 1)[0]
    record.own_id = text_hash(own.encode())
    data = np.frombuffer(text if isinstance(text, bytes) else text.encode(), np.uint8)
    return scan(data, 0, data.size, record), record


def state(**changes: Any) -> dict[str, Any]:
    device = {
        "status": {"ready": True, "calibrated": False},
        "state": {
            "modes": [[1, 2], [], {}],
            "cursor_position": {"z": 0.15, "x": -0.0123, "y": 1.5e-3},
            "cursor_velocity": {"x": 0, "y": -1, "z": 2.25},
        },
        "device_id": OWN,
        "config": {"note": 'a "quoted" \\ text: {]'},
    }
    other = {"device_id": "0000", "state": {"cursor_position": {"x": 9, "y": 9, "z": 9}}}
    message = {
        "session_id": 3,
        "inverse3": [other, device, other],
        "verse_grip": [{"state": {"button": True}}],
        "wireless_verse_grip": [{"state": {"buttons": {"a": False, "b": True, "c": False}}}],
    }
    return message | changes


@pytest.mark.parametrize("indent", [None, 3])
def test_scan_finds_the_numbers_of_its_own_device_in_any_order_of_keys(indent: int | None) -> None:
    outcome, record = scanned(json.dumps(state(), indent=indent))
    assert outcome == UNDERSTOOD
    assert list(record.value[POSITION : POSITION + 3]) == pytest.approx([-0.0123, 1.5e-3, 0.15], rel=1e-14)
    assert list(record.value[VELOCITY : VELOCITY + 3]) == [0.0, -1.0, 2.25]
    assert (record.value[READY], record.value[CALIBRATED], record.value[BUTTON]) == (1.0, 0.0, 1.0)
    assert list(record.value[BUTTONS : BUTTONS + 3]) == [0.0, 1.0, 0.0]


def test_scan_names_the_missing_value() -> None:
    assert scanned(json.dumps(state(inverse3=[])))[0] == NO_DEVICE
    assert scanned(json.dumps(state()), own="FFFF")[0] == NO_DEVICE
    assert scanned(json.dumps(state(inverse3=[{"device_id": OWN}])))[0] == WITHOUT_POSITION
    for number in ("null", "1e999", "-1e400"):
        assert scanned(json.dumps(state()).replace("-0.0123", number))[0] == NOT_FINITE


def test_scan_takes_no_number_of_another_device() -> None:
    own, other = state()["inverse3"][1::-1]
    outcome, record = scanned(json.dumps(state(inverse3=[own, other, {"device_id": OWN}])))
    assert outcome == UNDERSTOOD
    assert record.value[POSITION] == -0.0123


@pytest.mark.parametrize("number", ["NaN", "Infinity", "01", ".5", "5.", "1e", "+1", "0x1", "--1", "tru", "nul", "'a'"])
def test_scan_refuses_numbers_that_json_does_not_allow(number: str) -> None:
    assert scanned(json.dumps(state()).replace("-0.0123", number))[0] == NOT_JSON


def test_scan_refuses_a_message_cut_at_any_byte_or_with_anything_behind() -> None:
    text = json.dumps(state()).encode()
    assert {scanned(text[:cut])[0] for cut in range(len(text))} == {NOT_JSON}
    assert scanned(text + b"}")[0] == scanned(text + b" 1")[0] == NOT_JSON
    assert scanned(text + b" \n")[0] == UNDERSTOOD


def depth(value: Any) -> int:
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else None
    return 0 if inner is None else 1 + max(map(depth, inner), default=0)


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(st.dictionaries(st.text(max_size=8), VALUES, max_size=4))
def test_scan_takes_every_object_that_the_standard_library_writes(value: dict[str, Any]) -> None:
    said, _ = scanned(json.dumps(value))
    assert said == (NO_DEVICE if depth(value) < 15 else NOT_JSON)


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@given(st.data())
def test_scan_refuses_a_changed_byte_wherever_the_standard_library_does(data: st.DataObject) -> None:
    text = bytearray(json.dumps(state(), separators=(",", ":")).encode())
    at = data.draw(st.integers(0, len(text) - 1))
    text[at] = data.draw(st.sampled_from(b'{}[],:"0159.-eatn x'))
    try:
        valid = isinstance(json.loads(text), dict)
    except ValueError:
        valid = False
    said, _ = scanned(bytes(text))
    assert (said == NOT_JSON) == (not valid)


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@given(st.floats(-1e6, 1e6))
def test_scan_reads_numbers_as_the_standard_library_does(number: float) -> None:
    outcome, record = scanned(json.dumps(state()).replace("-0.0123", repr(number)))
    assert outcome == UNDERSTOOD
    assert math.isclose(record.value[POSITION], number, rel_tol=1e-14, abs_tol=1e-200)
