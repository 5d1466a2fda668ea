"""Sessions that were changed or lack something: replay names what, and where."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from pyarrow import parquet

from study_app.errors import StoreError
from study_app.session.replay import replay
from tests.compiled import needs_servo
from tests.session.replay.recorded_sessions import copied, rewrite, troubled
from tests.store.forging import Lines, forge

pytestmark = [needs_servo, pytest.mark.slow]

SECONDS = 1000  # ticks


def test_a_place_that_was_changed_is_named_by_trial_and_second(rehearsed: Path, tmp_path: Path) -> None:
    place = copied(rehearsed, tmp_path / "changed")

    def nudge(columns: dict[str, Any]) -> None:
        columns["position_x_m"][-5:] += 1e-9

    rewrite(place / "recordings" / "trial-002.parquet", nudge)
    found = replay(place)
    last = len(parquet.read_table(place / "recordings" / "trial-002.parquet")) // SECONDS
    where = f"differs in second {last} of {last + 1} seconds"
    assert f"trial 2, attempt 1: the force on the hand {where}" in found.differences
    assert all(line.startswith("trial 2, attempt 1: ") and line.endswith(where) for line in found.differences)


def retell(place: Path, change: Callable[[dict[str, Any]], dict[str, Any]]) -> None:
    """Change the lines of a journal; a line keeps its number."""

    def changed(lines: Lines) -> None:
        lines[:] = map(change, lines)

    forge(place / "journal.jsonl", changed)


def test_recordings_that_are_lost_or_missing_are_named(rehearsed: Path, tmp_path: Path) -> None:
    place = copied(rehearsed, tmp_path / "lost")
    own = {"n", "t_s", "at", "trial", "attempt"}

    def lose(line: dict[str, Any]) -> dict[str, Any]:
        if line["event"] != "recorded" or line["trial"] > 2:
            return line
        told = {name: value for name, value in line.items() if name in own}
        if line["trial"] == 1:
            return told | {"event": "recording_lost", "reason": "the disk was full"}
        return told | {"event": "note", "kind": "mark", "text": ""}

    retell(place, lose)
    found = replay(place)
    assert found.uncompared == (
        "trial 1, attempt 1: has no recording: the disk was full",
        "trial 2, attempt 1: has no recording: the journal gives no reason",
    )
    assert (found.recordings, found.differences, found.missing) == (2, (), ())
    assert found.proved
    (place / "recordings" / "trial-004.parquet").unlink()
    found = replay(place)
    assert found.missing == (
        "trial 4, attempt 1: recordings/trial-004.parquet is missing, but the journal mentions it",
    )
    assert (found.recordings, found.proved) == (1, False)


def test_what_goes_on_from_a_lost_recording_is_not_said_to_differ(tmp_path: Path) -> None:
    place = troubled(tmp_path / "results")
    assert replay(place).proved
    (place / "recordings" / "trial-001.parquet").unlink()
    found = replay(place)
    assert len(found.missing) == 1
    assert found.uncompared == tuple(
        f"trial 1, attempt {attempt}: continues from the force of a recording that is missing or has a gap"
        for attempt in (2, 3, 4)  # each began while the one before it could still be felt
    )
    assert (found.recordings, found.differences) == (1, ())


@pytest.mark.parametrize("name", ["device", "protocol", "seed", "participant"])
def test_a_receipt_that_lacks_what_ran_is_one_sentence(rehearsed: Path, tmp_path: Path, name: str) -> None:
    place = copied(rehearsed, tmp_path / "receipt")
    receipt = json.loads((place / "receipt.json").read_text())
    for changed, said in (
        ({other: value for other, value in receipt.items() if other != name}, f"lacks '{name}': restore it"),
        (receipt | {name: "?"}, f"is not a receipt .{name} is '.'"),
    ):
        (place / "receipt.json").write_text(json.dumps(changed))
        with pytest.raises(StoreError, match=said) as raised:
            replay(place)
        assert "\n" not in str(raised.value)


def test_a_session_with_an_estimator_that_left_the_program_is_not_recomputable(rehearsed: Path, tmp_path: Path) -> None:
    place = copied(rehearsed, tmp_path / "estimator")
    receipt = json.loads((place / "receipt.json").read_text())
    receipt["protocol"]["scene"]["velocity"] = {"kind": "line", "samples": 15}
    (place / "receipt.json").write_text(json.dumps(receipt))
    found = replay(place)
    assert (found.recordings, found.differences, found.proved) == (0, (), False)
    assert all('not recomputable: the velocity estimator "line" left the program' in it for it in found.uncompared)
    assert len(found.uncompared) == 4


def test_missing_samples_are_said_and_not_compared(rehearsed: Path, tmp_path: Path) -> None:
    place = copied(rehearsed, tmp_path / "gap")

    def lose(columns: dict[str, Any]) -> None:
        columns["tick"][-100:] += 7

    rewrite(place / "recordings" / "trial-001.parquet", lose)
    found = replay(place)
    assert found.differences == ()
    (said,) = found.uncompared
    assert said.startswith("trial 1, attempt 1: samples are missing after")


@pytest.mark.parametrize(
    ("column", "change", "named"),
    [
        ("device_force_x_n", 5.0, "column device_force_n"),
        ("device_force_z_n", 2.0**-13, "column device_force_n"),
        ("undelivered_y_n", 5.0, "column command_n"),
        ("withheld_x_n", 5.0, "column force_n"),
        ("velocity_y_mps", 0.1, "column velocity_mps"),
        ("wake_z_mps", 0.1, "column wake_mps"),
        ("limiters", 8, "column limiters"),
    ],
)
def test_a_recorded_column_that_was_changed_is_named(
    rehearsed: Path, tmp_path: Path, column: str, change: float, named: str
) -> None:
    place = copied(rehearsed, tmp_path / "column")

    def add(columns: dict[str, Any]) -> None:
        columns[column][-100] += change

    rewrite(place / "recordings" / "trial-001.parquet", add)
    assert any(f"the {named} differs in second" in said for said in replay(place).differences)


def test_no_sentence_tells_a_condition(rehearsed: Path, tmp_path: Path) -> None:
    place = copied(rehearsed, tmp_path / "told")
    for path in place.glob("recordings/trial-00?.parquet"):
        rewrite(path, lambda columns: columns["position_y_m"].__iadd__(1e-9))
    text = "\n".join(replay(place).differences)
    assert len(text.splitlines()) == 8
    assert not any(word in text for word in ("thin", "thick", "prompt", "late", "200", "1400"))


def test_another_key_is_refused(rehearsed: Path, tmp_path: Path) -> None:
    place = copied(rehearsed, tmp_path / "key")
    receipt = json.loads((place / "receipt.json").read_text())
    (place / "receipt.json").write_text(json.dumps(receipt | {"key_hash": "0" * 64}))
    with pytest.raises(StoreError, match="not the key"):
        replay(place)
