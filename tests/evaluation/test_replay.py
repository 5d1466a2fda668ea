"""Sessions replayed: the forces come out again to the last bit, and what was changed is named."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import pytest
from pyarrow import parquet

from study_app.devices.scripted import ScriptedDevice
from study_app.errors import StoreError
from study_app.evaluation import replay as replay_module
from study_app.evaluation.replay import replay
from study_app.haptics.model import gate
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.runtime.clocks.clock import VirtualClock
from study_app.haptics.runtime.servo import Servo
from study_app.protocol import formats
from study_app.protocol.orders.schedule import build_schedule
from study_app.session.pages import Page, TaskPage
from study_app.session.ports import Ports
from study_app.session.resume import resume_at
from study_app.session.runner import Runner
from study_app.session.simulated.rehearsal import rehearse
from study_app.session.transitions.events import (
    Begin,
    Continue,
    EndAsked,
    ForceStopped,
    PauseAsked,
    RepeatAsked,
    ResumeAsked,
)
from study_app.store import recording_files
from study_app.store.clock import SessionClock
from study_app.store.folders import StudyFolder
from study_app.store.sessions.begin import SessionStart, begin
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.reopen import reopen
from tests.compiled import needs_servo
from tests.faults.support import short
from tests.session import small
from tests.store.forging import Lines, forge

pytestmark = [needs_servo, pytest.mark.slow]

SECONDS = 1000  # ticks


class LightDevice(ScriptedDevice):
    """A device whose light handle and force limit permit less force than those of `ScriptedDevice`."""

    def __init__(self) -> None:
        super().__init__(force_limit_n=1.0)

    @property
    def dynamics(self) -> Dynamics:
        return Dynamics(0.0, 10e-6, 0.005)


class TachometerDevice(ScriptedDevice):
    """A device that measures its velocity."""

    def __init__(self) -> None:
        super().__init__()
        self.measure_velocity()


def begun(folder: Path, device: ScriptedDevice, servo: Servo) -> SessionStore:
    return begin(
        folder,
        small.protocol(),
        b"small",
        SessionStart(
            "P001",
            seed=1,
            operator="",
            language="en",
            device=device.describe(),
            screens={},
            simulated=True,
            recordings=True,
        ),
        clock=SessionClock(servo.now_ns),
    )


def held(store: SessionStore, device: ScriptedDevice, servo: Servo) -> tuple[Runner, Callable[[int], None]]:
    """Return the runner of a session in which a hand moves, and what lets ticks pass."""
    study, t_s = small.protocol(), np.arange(0, 60, 0.005)
    schedule = build_schedule(study, "P001", 1)

    def present(page: Page) -> None:
        if isinstance(page, TaskPage):
            runner.frame_shown(servo.now_ns(), servo.now_ns())

    def wait(ticks: int) -> None:
        for _ in range(ticks // 50):
            servo.advance(50)
            runner.poll()

    ports = Ports(servo, store, present, store.clock.seconds, store.recorder, paints=False)
    runner = Runner(study, schedule, store.key.codes, ports, "en", resume_at(study, schedule, store.lines))
    device.follow(t_s, np.column_stack((0.03 * np.sin(6 * t_s), 0.01 * np.cos(9 * t_s), 0 * t_s)))
    return runner, wait


def resumed_on_another_device(folder: Path) -> Path:
    """Hold a session that goes on with another device after its first trial; return its folder."""
    with ScriptedDevice() as device, Servo(device, clock=VirtualClock(), elements=100) as servo:
        with begun(folder, device, servo) as store:
            runner, wait = held(store, device, servo)
            runner.post(Begin(store.clock.seconds()))
            runner.post(Continue(store.clock.seconds()))
            wait(1500)
            runner.post(PauseAsked(store.clock.seconds(), "operator"))
        place: Path = store.folder.path
    with LightDevice() as device, Servo(device, clock=VirtualClock(), elements=100) as servo:
        described = device.describe()
        with reopen(
            place, small.protocol(), b"small", operator="", device=described, screens={}, now_ns=servo.now_ns
        ) as store:
            runner, wait = held(store, device, servo)
            servo.advance(900)  # its recording begins at a tick that the one before holds too
            runner.post(Begin(store.clock.seconds()))
            runner.post(ResumeAsked(store.clock.seconds(), "operator"))
            wait(1500)
            runner.post(EndAsked(store.clock.seconds(), "aborted", ""))
    return place


def troubled(folder: Path) -> Path:
    """Hold a session in which all happens that changes a force from outside; return its folder."""
    device = ScriptedDevice()
    with device, Servo(device, clock=VirtualClock(), elements=100) as servo:
        store = begun(folder, device, servo)
        clock = store.clock
        with store:
            runner, wait = held(store, device, servo)
            runner.post(Begin(clock.seconds()))
            servo.advance(20)
            runner.post(Continue(clock.seconds()))  # so early that the servo's own fade is under way
            wait(700)
            runner.post(RepeatAsked(clock.seconds(), "a sneeze"))  # from one force into the next
            wait(850)
            servo.advance(7)
            runner.post(RepeatAsked(clock.seconds(), "another"))
            wait(900)
            runner.post(ForceStopped(clock.seconds(), "operator"))
            wait(300)
            runner.post(ResumeAsked(clock.seconds(), "operator"))
            wait(800)
            runner.post(PauseAsked(clock.seconds(), "operator"))
            wait(2000)
            runner.post(ResumeAsked(clock.seconds(), "operator"))
            wait(1500)
            runner.post(EndAsked(clock.seconds(), "aborted", ""))
            place: Path = store.folder.path
    return place


@pytest.fixture(scope="module")
def rehearsed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("replay")
    rehearse(short.write(folder), participants=1, seed=1, results=folder / "results")
    return folder / "results"


def session(results: Path) -> Path:
    return StudyFolder(results).sessions()[0].path


def copied(results: Path, to: Path) -> Path:
    for path in results.rglob("*"):
        if path.is_file():
            there = to / path.relative_to(results)
            there.parent.mkdir(parents=True, exist_ok=True)
            there.write_bytes(path.read_bytes())
    return session(to)


@pytest.mark.slow
def test_a_rehearsed_session_comes_out_to_the_last_bit(rehearsed: Path) -> None:
    found = replay(session(rehearsed))
    assert (found.differences, found.uncompared) == ((), ())
    assert found.recordings == 4
    assert found.lasted_s > 3
    assert found.seconds == sum(
        len(recording_files.read_checks(path).device_force)
        for path in session(rehearsed).glob("recordings/trial-00?.parquet")
    )
    assert found.proved
    assert 0 < found.computed_s < found.took_s


def test_a_session_is_replayed_with_the_model_that_its_receipt_records(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Replay uses the recorded effects where this program would choose others, and the recorded estimator."""
    file = short.write(tmp_path)
    text = file.read_text(encoding="utf-8").replace("format = 1", "format = 2", 1)
    file.write_text(re.sub(r"^effects = \[.*?\]", 'effects = "auto"', text, flags=re.MULTILINE), encoding="utf-8")
    rehearse(file, participants=1, seed=1, results=tmp_path / "results")
    place = session(tmp_path / "results")
    assert json.loads((place / "receipt.json").read_text())["protocol"]["scene"]["velocity"] == {"kind": "kalman"}
    monkeypatch.setattr(gate, "_budget_n", lambda _scene, total_n: 0.9 * total_n)
    monkeypatch.setattr(formats, "ESTIMATOR", "ewma")
    found = replay(place)
    assert (found.differences, found.uncompared) == ((), ())
    assert found.recordings == 4
    monkeypatch.setattr(replay_module, "as_recorded", lambda protocol, _receipt, _key: protocol)
    assert replay(place).differences


def test_repeats_pauses_stops_and_fades_come_out_to_the_last_bit(tmp_path: Path) -> None:
    found = replay(troubled(tmp_path / "results"))
    assert (found.differences, found.uncompared) == ((), ())
    assert found.recordings == 5


def test_a_session_that_goes_on_with_another_device_comes_out_to_the_last_bit(tmp_path: Path) -> None:
    place = resumed_on_another_device(tmp_path / "results")
    found = replay(place)
    assert (found.differences, found.uncompared) == ((), ())
    assert (found.recordings, found.proved) == (2, True)
    receipt = json.loads((place / "receipt.json").read_text())
    (place / "receipt.json").write_text(json.dumps(receipt | {"resumed": []}))
    with pytest.raises(StoreError, match="lacks the device since"):
        replay(place)


def test_a_session_on_a_device_that_measures_velocity_comes_out_to_the_last_bit(tmp_path: Path) -> None:
    with (
        TachometerDevice() as device,
        Servo(device, clock=VirtualClock(), elements=100) as servo,
        begun(tmp_path / "results", device, servo) as store,
    ):
        runner, wait = held(store, device, servo)
        runner.post(Begin(store.clock.seconds()))
        wait(500)
        runner.post(Continue(store.clock.seconds()))
        wait(1500)
        runner.post(EndAsked(store.clock.seconds(), "aborted", ""))
        place: Path = store.folder.path
    found = replay(place)
    assert (found.differences, found.uncompared) == ((), ())
    assert (found.recordings, found.proved) == (1, True)

    def nudge(columns: dict[str, Any]) -> None:
        columns["device_velocity_x_mps"][-5:] += 1e-9

    rewrite(place / "recordings" / "trial-001.parquet", nudge)
    assert any("force on the hand differs" in line for line in replay(place).differences)


@pytest.mark.parametrize("ticks", [200, 450, 550, 650])
def test_a_trial_soon_after_a_short_preflight_comes_out_to_the_last_bit(tmp_path: Path, ticks: int) -> None:
    """The recording begins while the servo's start fade is under way, of which 0.1 s are over by then."""
    with ScriptedDevice() as device, Servo(device, clock=VirtualClock(), elements=100) as servo:
        servo.advance(100)
        with begun(tmp_path / "results", device, servo) as store:
            runner, wait = held(store, device, servo)
            runner.post(Begin(store.clock.seconds()))
            wait(ticks - 100)
            runner.post(Continue(store.clock.seconds()))
            wait(1500)
            runner.post(EndAsked(store.clock.seconds(), "aborted", ""))
            place: Path = store.folder.path
    found = replay(place)
    assert (found.differences, found.uncompared) == ((), ())
    assert (found.recordings, found.proved) == (1, True)


def rewrite(path: Path, change: Callable[[dict[str, Any]], None]) -> None:
    """Change the columns of a recording and keep its checks, as a mistake or a forger would."""
    facts = parquet.read_metadata(path).metadata[b"liquid_study"]
    table = parquet.read_table(path)
    columns = {name: table.column(name).to_numpy().copy() for name in table.column_names}
    change(columns)
    with parquet.ParquetWriter(path, table.schema) as writer:
        writer.write_table(pa.table(columns, schema=table.schema))
        writer.add_key_value_metadata({b"liquid_study": facts})


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


def test_a_session_without_recordings_proves_nothing(tmp_path: Path) -> None:
    rehearse(short.write(tmp_path), participants=1, seed=1, results=tmp_path / "results", recordings=False)
    found = replay(session(tmp_path / "results"))
    assert (found.recordings, found.seconds, found.proved) == (0, 0, False)
    assert (found.differences, found.missing, found.uncompared) == ((), (), ())


@pytest.mark.parametrize("name", ["device", "protocol"])
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
