"""What tells a condition cannot be read in a journal, opens whole with the key, and not when it was changed."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.errors import StoreError
from study_app.store.blinded.blinding import Key, open_events, seal_event
from study_app.store.blinded.sealing import MARK, open_file, recording_bytes, samples_bytes, seal_file
from study_app.store.files.columns import SEALED, TRIALS
from tests.journal_lines import event_of

START = event_of("session_started", n=1, participant="P007", session=1, measures_sealed=True)
WHICH = {"trial": 3, "attempt": 1, "outcome": "complete"}
MEASURED = {
    column.name: 0 if column.kind == "integer" else 0.1 + 0.2
    for column in TRIALS
    if column.sealed and column.name != "group"
}


def key(nonce: bytes = bytes(32)) -> Key:
    return Key(hash="", drawn="system", codes={}, tables={}, tables_hash="", nonce=nonce)


def sealed_trial_end(measured: dict[str, Any], **changes: Any) -> dict[str, Any]:
    return seal_event(START, event_of("trial_ended", **WHICH | measured | changes), key()).fields() | {"n": 2}


def found_in(line: dict[str, Any], event: str = "trial_ended", *, used: Key | None = None, start: Any = START) -> Any:
    """Return the fields of a line after the key was opened."""
    return open_events([start, event_of(event, **line)], used or key())[1].fields()


def test_only_fields_that_reveal_a_condition_are_sealed() -> None:
    """Forces, limiters, withheld shares, speed, pace and achieved delay are sealed, but not the program's timing."""
    sealed_names = (
        "force_mean_n",
        "limiter_slope",
        "withheld_share",
        "mean_speed_mps",
        "duration_s",
        "delay_error_p95_ms",
    )
    assert set(sealed_names) < SEALED
    assert not {"tick_rate_hz", "lateness_p99_ms", "worst_gap_ms", "overruns", "first_frame_gap_ms", "valid"} & SEALED
    line = sealed_trial_end(MEASURED, overruns=3)
    assert line.keys() == {"n", "sealed", "overruns", *WHICH}
    assert line["overruns"] == 3


def test_a_sealed_event_opens_with_all_fields_and_numpy_numbers_as_python_numbers() -> None:
    line = sealed_trial_end(
        MEASURED | {"force_mean_n": np.float64(0.25), "ticks": np.int64(7), "withheld_share": math.nan}
    )
    fields = {"force_mean_n": 0.25, "ticks": 7, "withheld_share": None}
    assert found_in(line) == {**WHICH, **MEASURED, **fields}
    lines = [START, event_of("trial_ended", **line)]
    assert open_events(lines, None) == lines


@pytest.mark.slow
@given(
    st.dictionaries(
        st.sampled_from(sorted(SEALED - {"group"})), st.one_of(st.none(), st.integers(0, 10**18), st.floats(0, 1))
    )
)
def test_all_texts_are_equally_long_and_every_number_comes_back(measured: dict[str, Any]) -> None:
    """Otherwise the length of a line would reveal the number of digits of the force."""
    integers = {column.name for column in TRIALS if column.kind == "integer"}
    measured = {
        name: int(value) if name in integers and value is not None else value for name, value in measured.items()
    }
    line = sealed_trial_end(measured)
    if measured:
        assert len(line["sealed"]) == len(sealed_trial_end(MEASURED)["sealed"])
    assert found_in(line) == {**WHICH, **measured}


def test_a_file_has_the_room_of_its_kind_doubled_until_it_fits_and_opens_unless_it_was_changed() -> None:
    head, secret = len(MARK) + 16, bytes(range(32))
    rooms = {count: len(seal_file(bytes(count), 100, secret)) - head for count in (0, 92, 93, 192, 193)}
    assert rooms == {0: 100, 92: 100, 93: 200, 192: 200, 193: 400}
    seconds = {0.1: 1, 1.0: 1, 1.1: 2, 2.0: 2, 3.0: 4, 5.0: 8}
    assert [samples_bytes(recording, 500.0) for recording in seconds] == [
        16_384 + 64 * 500 * room for room in seconds.values()
    ]
    assert recording_bytes(3.0, 500.0) == 2 * 16_384 + 4 * (64 * 500 + 6_000)
    sealed = seal_file(b"what was felt", 100, secret)
    assert open_file(bytes(sealed), secret) == b"what was felt"
    assert open_file(bytes(sealed), bytes(32)) is open_file(bytes(sealed[:-1]) + b"!", secret) is None


def test_equal_numbers_of_two_trials_look_different() -> None:
    first, second = (sealed_trial_end(MEASURED, trial=number)["sealed"] for number in (3, 4))
    alike = sum(byte == other_byte for byte, other_byte in zip(first, second, strict=True)) / len(first)
    assert alike < 0.15


def test_a_sealed_event_that_was_changed_or_moved_or_has_another_key_is_refused() -> None:
    line, place = sealed_trial_end(MEASURED), {"trial": 3, "attempt": 1, "interval": 1}
    interval = seal_event(START, event_of("interval_ended", **place, force_mean_n=0.5), key()).fields() | {"n": 2}
    assert found_in(interval, "interval_ended")["force_mean_n"] == 0.5
    changed_lines = [
        line | change for change in ({"sealed": "00" * 500}, {"sealed": ""}, {"sealed": "x"}, {"trial": 4})
    ]
    changed_lines += [line | {"attempt": 2}, interval]
    others = [(line, "trial_ended", key(), START) for line in changed_lines]
    others.append((interval | {"interval": 2}, "interval_ended", key(), START))
    others.append((line, "trial_ended", key(bytes([1] * 32)), START))
    others.append((line, "trial_ended", key(), replace(START, participant="P008")))
    for sealed_line, event, used, start in others:
        with pytest.raises(StoreError, match=r"line 2 of the journal cannot be decrypted with the study's key"):
            found_in(sealed_line, event, used=used, start=start)
