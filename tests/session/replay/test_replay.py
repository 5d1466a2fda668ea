"""Sessions replayed: the forces come out again to the last bit, and what was changed is named."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from study_app.devices.rig import Rig
from study_app.devices.simulated import ScriptedDevice
from study_app.errors import StoreError
from study_app.haptics.model import gate
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.force_rules import FORCE_RULES, VERSIONS
from study_app.haptics.model.layout import LIMITER_ENERGY, LIMITER_GLITCH, LIMITER_SLEW, LIMITER_SLOPE
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo
from study_app.session import replay as replay_module
from study_app.session.replay import Replayed, differing_columns, replay
from study_app.session.simulated.rehearsal import rehearse
from study_app.session.transitions.events import Begin, Continue, EndRequested, PauseRequested, ResumeRequested
from study_app.store import recordings
from study_app.store.blinded.blinding import open_events, read_key
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.sessions.recovery import reopen_store
from tests.compiled import needs_servo
from tests.faults.support import short
from tests.journal_lines import raw
from tests.session import small
from tests.session.replay.recorded_sessions import STRESSED, begun, held, rewrite, session, stressed, troubled
from tests.store.forging import secret_of

pytestmark = [needs_servo, pytest.mark.slow]


def test_a_measure_that_only_one_side_has_differs() -> None:
    recomputed = {"same": 1.0, "neither": None, "lost": 1.0, "added": None, "other": 2.0, "unknown": 3.0}
    ended = {"same": 1.0, "neither": None, "lost": None, "added": 1.0, "other": 2.1}
    assert list(differing_columns(recomputed, ended)) == ["lost", "added", "other"]


@pytest.fixture(scope="module")
def rehearsed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("replay")
    rehearse(short.write(folder), participants=1, seed=1, results=folder / "results")
    return folder / "results"


class LightDevice(ScriptedDevice):
    """A device whose light handle and force limit permit less force than those of `ScriptedDevice`."""

    def __init__(self) -> None:
        super().__init__(force_limit_n=1.0)

    @property
    def dynamics(self) -> Dynamics:
        return Dynamics(delay_s=0.0, count_m=10e-6, mass_kg=0.005)


class TachometerDevice(ScriptedDevice):
    """A device that measures its velocity."""

    def __init__(self) -> None:
        super().__init__()
        self.measure_velocity()


def resumed_on_another_device(folder: Path) -> Path:
    """Run a session that continues with another device after its first trial; return its folder."""
    with ScriptedDevice() as device, Servo(device, clock=VirtualClock(), elements=100) as servo:
        with begun(folder, device, servo) as store:
            runner, wait = held(store, device, servo)
            runner.post(Begin(store.clock.seconds()))
            runner.post(Continue(store.clock.seconds()))
            wait(1500)
            runner.post(PauseRequested(store.clock.seconds(), "operator"))
        place: Path = store.folder.path
    with LightDevice() as device, Servo(device, clock=VirtualClock(), elements=100) as servo:
        description = Rig(device, servo).described
        with reopen_store(
            place, small.protocol(), b"small", operator="", device=description, screens={}, now_ns=servo.now_ns
        ) as store:
            runner, wait = held(store, device, servo)
            servo.advance(900)  # its recording begins at a tick that the one before holds too
            runner.post(Begin(store.clock.seconds()))
            runner.post(ResumeRequested(store.clock.seconds(), "operator"))
            wait(1500)
            runner.post(EndRequested(store.clock.seconds(), "aborted", ""))
    return place


def test_the_task_of_an_interval_begins_with_its_first_sample_that_was_not_rejected() -> None:
    samples = np.zeros(6, [("scene", "i4"), ("limiters", "u4"), ("time_ns", "i8")])
    samples["scene"], samples["limiters"] = (4, 5, 5, 5, 5, 5), (0, LIMITER_GLITCH, 0, LIMITER_GLITCH, 0, 0)
    samples["time_ns"] = (100, 200, 300, 1300, 2300, 2301)
    assert replay_module._interval_samples(samples, 2e-6)["time_ns"].tolist() == [200, 300, 1300, 2300]


def test_at_most_eight_seconds_that_differ_are_listed() -> None:
    lists_of_seconds = [replay_module._list_seconds([*range(count)]) for count in (1, 8, 9)]
    assert lists_of_seconds == [
        "second 0",
        "second 0, 1, 2, 3, 4, 5, 6, 7",
        "second 0, 1, 2, 3, 4, 5, 6, 7 … (9 in all)",
    ]


def comes_out(place: Path, count: int) -> Replayed:
    """Replay a session; check that its recordings agree bit by bit."""
    replay_result = replay(place)
    assert (replay_result.differences, replay_result.missing, replay_result.uncompared) == ((), (), ())
    assert (replay_result.recordings, replay_result.proved) == (count, True)
    paths = [path for path in place.glob("recordings/*.parquet") if "frames" not in path.name]
    times_ns = [recordings.read_samples(path, secret_of(path)).time_ns for path in paths]
    assert replay_result.lasted_s == pytest.approx(sum(float(times[-1] - times[0]) for times in times_ns) / 1e9)
    return replay_result


def stirred(folder: Path, device: ScriptedDevice, *, before: int, until: int) -> Path:
    """Run a session up to its first trial, with a servo that started some ticks earlier; return its folder."""
    with device, Servo(device, clock=VirtualClock(), elements=100) as servo:
        servo.advance(before)
        with begun(folder, device, servo) as store:
            runner, wait = held(store, device, servo)
            runner.post(Begin(store.clock.seconds()))
            wait(until - before)
            runner.post(Continue(store.clock.seconds()))
            wait(1500)
            runner.post(EndRequested(store.clock.seconds(), "aborted", ""))
        place: Path = store.folder.path
    return place


def test_a_rehearsed_session_is_replayed_bit_by_bit(rehearsed: Path) -> None:
    replay_result = comes_out(session(rehearsed), 4)
    assert replay_result.lasted_s > 3
    assert replay_result.seconds == sum(
        len(recordings.read_checks(path, secret_of(path)).device_force)
        for path in session(rehearsed).glob("recordings/trial-00?.parquet")
    )
    assert 0 < replay_result.computed_s < replay_result.took_s


def test_the_replayed_force_error_is_equal_and_a_different_one_is_named(
    rehearsed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = StudyFolder(rehearsed)
    lines = raw(open_events(journal.read(session(rehearsed) / "journal.jsonl"), read_key(study.path)))
    errors = [line["delivered_error"] for line in lines if line["event"] == "trial_ended"]
    known_errors = [error for error in errors if error is not None]  # some of its trials are shorter than the fade-in
    assert len(known_errors) > 0
    assert all(0.005 < error < 1.0 for error in known_errors)
    right = replay_module.recompute_force_error
    monkeypatch.setattr(replay_module, "recompute_force_error", lambda *which: right(*which) + 2e-6)
    differences = replay(session(rehearsed)).differences
    assert len(differences) == len(known_errors)
    assert all(difference.endswith("the column delivered_error differs") for difference in differences)


def test_each_computed_column_of_a_recording_is_compared(rehearsed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read_samples = recordings.read_samples
    columns = (*recordings.ROUNDED_TO, "limiters", "status")

    def changed_samples(path: Path, secret: bytes) -> Any:
        samples = read_samples(path, secret)
        for row, name in enumerate(columns, start=1):
            samples[name][-row] += 1
        return samples

    monkeypatch.setattr(recordings, "read_samples", changed_samples)
    differences = replay(session(rehearsed)).differences
    names = ["force on the hand" if name == "device_force_n" else f"column {name}" for name in columns]
    counts = {name: sum(f"the {name} differs in second" in difference for difference in differences) for name in names}
    assert counts == dict.fromkeys(names, 4)


def test_a_session_is_replayed_with_the_model_that_its_receipt_records(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Replay uses the recorded effects where this program would choose others, and the recorded estimator."""
    file = short.write(tmp_path)
    text = re.sub(r"\[scene.velocity\]\nkind = .*\n", "", file.read_text(encoding="utf-8"))
    file.write_text(
        re.sub(r"^effects = \[.*?\]", 'effects = "auto"', text, flags=re.MULTILINE), encoding="utf-8", newline="\n"
    )
    rehearse(file, participants=1, seed=1, results=tmp_path / "results")
    place = session(tmp_path / "results")
    assert json.loads((place / "receipt.json").read_text("utf-8"))["protocol"]["scene"]["velocity"] == {
        "kind": "kalman"
    }
    monkeypatch.setattr(gate, "_budget_n", lambda _scene, total_n: 0.9 * total_n)
    monkeypatch.setattr("study_app.protocol.file_format.formats.ESTIMATOR", "ewma")
    comes_out(place, 4)
    monkeypatch.setattr(replay_module, "recorded_protocol", lambda protocol, _receipt, _key: protocol)
    assert replay(place).differences


def test_repeats_pauses_stops_and_fades_are_replayed_bit_by_bit(tmp_path: Path) -> None:
    place = troubled(tmp_path / "results")
    comes_out(place, 5)
    (place / "recordings" / "trial-001.parquet").unlink()
    replay_result = replay(place)
    unknown = ("trial 1, attempt 2", "trial 1, attempt 3", "trial 1, attempt 4")
    why = "the recording continues an earlier one, which is missing or has a gap"
    assert (replay_result.recordings, replay_result.differences) == (1, ())
    assert replay_result.uncompared == tuple(f"{name}: {why}" for name in unknown)


@pytest.mark.parametrize("liquid", STRESSED)
def test_limited_forces_are_replayed_bit_by_bit(tmp_path: Path, liquid: str) -> None:
    place = stressed(tmp_path / "results", liquid)
    recording = place / "recordings" / "trial-001.parquet"
    limiters = recordings.read_samples(recording, secret_of(recording)).limiters
    assert all((limiters & bit).any() for bit in (LIMITER_SLOPE, LIMITER_ENERGY, LIMITER_SLEW))
    comes_out(place, 1)


def test_a_session_continued_with_another_device_is_replayed_bit_by_bit(tmp_path: Path) -> None:
    place = resumed_on_another_device(tmp_path / "results")
    comes_out(place, 2)
    receipt = json.loads((place / "receipt.json").read_text("utf-8"))
    (place / "receipt.json").write_text(json.dumps(receipt | {"resumed": []}), encoding="utf-8", newline="\n")
    with pytest.raises(StoreError, match="does not state which device has been used since"):
        replay(place)


def test_each_part_of_a_session_is_replayed_by_the_force_rules_that_its_receipt_states(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for liquid in small.TABLES["liquids"].values():
        monkeypatch.setitem(liquid, "effects", ["drag", "added_mass"])
    place = resumed_on_another_device(tmp_path / "results")
    receipt = json.loads((place / "receipt.json").read_text("utf-8"))
    lighter = receipt["resumed"][0]["device"]
    assert receipt["device"]["force_rules"] == lighter["force_rules"] == FORCE_RULES
    monkeypatch.setitem(VERSIONS, 1, VERSIONS[1]._replace(cut_inertia_share=0.0))
    assert replay(place).proved
    del lighter["force_rules"]
    (place / "receipt.json").write_text(json.dumps(receipt), encoding="utf-8", newline="\n")
    differences = replay(place).differences
    assert differences
    assert all(line.startswith("trial 1, attempt 2:") for line in differences)
    lighter["force_rules"] = FORCE_RULES + 1
    (place / "receipt.json").write_text(json.dumps(receipt), encoding="utf-8", newline="\n")
    with pytest.raises(
        StoreError,
        match=f"force rules {FORCE_RULES + 1}, but this version of liquid-study supports only rules 1 to {FORCE_RULES}",
    ):
        replay(place)


def test_a_session_with_measured_velocity_is_replayed_bit_by_bit(tmp_path: Path) -> None:
    place = stirred(tmp_path / "results", TachometerDevice(), before=0, until=500)
    comes_out(place, 1)

    def nudge(columns: dict[str, Any]) -> None:
        columns["device_velocity_x_mps"][-5:] += 1e-9

    rewrite(place / "recordings" / "trial-001.parquet", nudge)
    assert any("force on the hand differs" in line for line in replay(place).differences)


@pytest.mark.parametrize("ticks", [200, 450, 550, 650])
def test_a_trial_soon_after_a_short_preflight_is_replayed_bit_by_bit(tmp_path: Path, ticks: int) -> None:
    """The recording begins while the servo's start fade is under way, of which 0.1 s are over by then."""
    comes_out(stirred(tmp_path / "results", ScriptedDevice(), before=100, until=ticks), 1)
