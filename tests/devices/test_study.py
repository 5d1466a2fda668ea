"""The thesis' study on each emulated device, through all of its driver: the same sessions as on the scripted hand."""

import csv
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pyarrow.parquet
import pytest

from study_app.devices import simulated as scripted
from study_app.devices.hand import HandOrders
from study_app.errors import SessionError
from study_app.haptics.model.layout import LIMITER_GLITCH, STATUS_OK
from study_app.haptics.model.slope_limits import slew_limit_n
from study_app.protocol.load import load
from study_app.session.simulated import rehearsal
from study_app.session.simulated.observers import exploration
from study_app.session.simulated.rehearsal import RehearsedSession
from study_app.store.blinded.unblinding import unblind
from study_app.store.folders import StudyFolder
from study_app.store.verification.verify_study import verify
from tests.compiled import needs_servo
from tests.store.forging import parquet_of

pytestmark = [pytest.mark.nightly, needs_servo, pytest.mark.slow]

STUDY = "rek2024"
HALF_M = (0.05, 0.03, 0.03)
POSITION = [f"position_{axis}_m" for axis in "xyz"]
LOOK_S = 0.1
"""How often the simulated participant looks: a target reached within a count of its edge may be seen a look later."""
LEAD_S = 0.5
MAY_DIFFER = {
    "device",
    "answered_at",
    "trial_started_at",
    "session_started_at",
    "session_ended_at",
    # what encoders of another count, or a position of another tick, say of the same motion
    "response",
    "path_length_m",
    "mean_speed_mps",
    "force_mean_n",
    "withheld_share",
    "loop_delay_ticks",
    "force_peak_n",
    "delivered_error",
    # a tied hand sets out within a tick: whether that exceeds the acceleration of a hand depends on the encoder's count
    "limiter_glitch",
    "limiter_fade",
    "limiter_slope",
    "limiter_energy",
    "limiter_norm",
    "limiter_slew",
}
"""Columns of trials and responses that need not be equal on two devices."""
FOLLOW = HandOrders.follow


def tie_hand(patch: pytest.MonkeyPatch) -> None:
    """Let no force move the simulated hand off its path at the handle."""
    patch.setattr(scripted, "STIFFNESS_NPM", 1e6)
    patch.setattr(scripted, "DAMPING_NSPM", 2e3)


def follow_from_here(hand: HandOrders, t_s: Any, position_m: Any) -> None:
    """Follow a path, but come onto it from where the hand is: a tied hand would leap, and the force with it."""
    times, places = np.asarray(t_s, np.float64), np.asarray(position_m, np.float64)
    share = np.clip((times - times[0]) / LEAD_S, 0.0, 1.0)
    left = 1.0 - share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    FOLLOW(hand, times, places + left[:, np.newaxis] * (np.array(hand.aim_m) - places[0]))


@dataclass(frozen=True)
class Expected:
    """How a device's sessions may differ from those of the scripted hand, and what its receipt says."""

    receipt: dict[str, Any]
    exact: bool = True  # the scripted hand's encoders are exact: its recordings hold the path itself
    follow: Any = FOLLOW
    share: float = 0.0  # of a number that follows from times
    looks: int = 0


DEVICES = {
    "falcon-emulated": Expected({"calibration": "none", "firmware": "already running"}),
    "inverse3-emulated": Expected({"force_scale": 1.0}, follow=follow_from_here, share=0.02, looks=5),
    "force-dimension-emulated": Expected({"system": "emulated"}, exact=False, share=0.02, looks=5),
}


@dataclass(frozen=True)
class Rehearsed:
    """The study on the scripted hand and on a device, unblinded: one seed, a tied hand."""

    device: str
    by_script: StudyFolder
    by_device: StudyFolder

    @property
    def expected(self) -> Expected:
        return DEVICES[self.device]

    def tables(self, name: str) -> Iterator[tuple[dict[str, str], dict[str, str]]]:
        """Yield the rows of both tables."""
        one, other = (table(folder, name) for folder in (self.by_script, self.by_device))
        assert len(one) == len(other) > 10
        yield from zip(one, other, strict=True)

    def recordings(self) -> Iterator[tuple[Any, Any]]:
        """Yield both recordings of each of the twelve trials, as data frames."""
        rows = table(self.by_script, "trials")
        assert len(rows) == 12
        for row in rows:
            files = (folder.sessions()[0].path / row["recording"] for folder in (self.by_script, self.by_device))
            one, other = (pyarrow.parquet.read_table(parquet_of(file)).to_pandas() for file in files)
            yield one, other


@pytest.fixture(scope="module", params=DEVICES)
def rehearsed(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Rehearsed:
    folders = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LIQUID_STUDY_CONFIG", str(tmp_path_factory.mktemp("settings")))
        tie_hand(patch)
        patch.setattr(HandOrders, "follow", DEVICES[request.param].follow)
        if DEVICES[request.param].exact:
            patch.setitem(scripted.ScriptedDevice.__init__.__kwdefaults__, "quantum_m", 0.0)
        for name in ("scripted", request.param):
            folder = tmp_path_factory.mktemp("results") / name
            rehearsal.rehearse(STUDY, participants=1, seed=3, device=name, results=folder)
            unblind(folder, "AB", "to compare what was measured")
            folders.append(StudyFolder(folder))
    return Rehearsed(request.param, *folders)


def rows_of(file: Path) -> list[dict[str, str]]:
    with file.open(newline="", encoding="utf-8") as lines:
        return list(csv.DictReader(lines))


def table(folder: StudyFolder, name: str) -> list[dict[str, str]]:
    """Return the rows of a table of the study's only session."""
    return rows_of(folder.sessions()[0].table(STUDY, name))


def same(expected: Expected, column: str, one: str, other: str) -> bool:
    """Return whether two cells agree: times within some looks, numbers that follow from them within a share."""
    try:
        difference = abs(float(one) - float(other))
    except ValueError:
        return one == other
    most = expected.looks * LOOK_S if column.endswith("_s") else expected.share * abs(float(one))
    return difference <= most


@pytest.mark.parametrize("name", ["trials", "responses"])
def test_the_study_has_the_same_rows_as_on_the_scripted_hand(rehearsed: Rehearsed, name: str) -> None:
    for one, other in rehearsed.tables(name):
        assert list(one) == list(other)
        for column in one.keys() - MAY_DIFFER:
            assert same(rehearsed.expected, column, one[column], other[column]), (column, one[column], other[column])
        if name == "responses":  # felt through other encoders, the opinion may differ by a point
            assert abs(int(one["response"]) - int(other["response"])) <= 1


def test_the_study_verifies_and_its_receipt_names_the_device(rehearsed: Rehearsed) -> None:
    folder = rehearsed.by_device
    assert verify(folder.path).errors == ()
    receipt = json.loads(folder.sessions()[0].receipt.read_text())["device"]
    assert receipt["name"] == rehearsed.device
    assert receipt.items() >= rehearsed.expected.receipt.items()
    for one in (rehearsed.by_script, folder):
        trials = table(one, "trials")
        assert {(row["valid"], row["simulated"], row["outcome"]) for row in trials} == {("true", "true", "complete")}


def test_positions_are_those_of_the_path(rehearsed: Rehearsed) -> None:
    """A Falcon's within 60 um; of the others within a count, the Inverse3's a tick later."""
    alike = 0
    for one, other in rehearsed.recordings():
        path_m, seen_m, fresh = one[POSITION].to_numpy(), other[POSITION].to_numpy(), other["fresh"].to_numpy()
        if rehearsed.device != "falcon-emulated" and len(path_m) != len(seen_m):
            assert abs(len(path_m) - len(seen_m)) <= 1000 * LOOK_S
            break  # a target was reached a look later: from here on the same tremor meets another part of the path
        alike += 1
        if rehearsed.device == "falcon-emulated":
            assert np.linalg.norm(seen_m - path_m, axis=1)[fresh].max() < 60e-6
            # a path that begins elsewhere takes a tied hand there within a tick, which is not believed at first
            (leaps,) = np.nonzero(np.linalg.norm(np.diff(path_m, axis=0), axis=1) > 1e-3)
            assert (~fresh).sum() <= 2 * len(leaps) <= 4
            continue
        assert fresh.all()
        if rehearsed.device == "inverse3-emulated":
            path_m, seen_m = path_m[:-1], seen_m[1:]
        assert np.abs(seen_m - path_m).max() <= 1.01 * scripted.QUANTUM_M
    assert alike >= (12 if rehearsed.device == "falcon-emulated" else 4)


def test_mean_forces_are_those_of_the_path_trial_by_trial(rehearsed: Rehearsed) -> None:
    """A single tick differs as much as encoders of a finite count make it."""
    for row, other in rehearsed.tables("trials"):
        force_n = float(row["force_mean_n"])
        assert float(other["force_mean_n"]) == pytest.approx(force_n, abs=max(0.05 * force_n, 0.05))


def felt(device: Any, scene: Any, lasting_s: float, given_n: list[Any] | None = None) -> Any:
    """Return all samples of a device whose hand explores a scene; ``given_n`` gets what its motors give each tick."""
    from study_app.haptics.runtime.clocks.clock import VirtualClock
    from study_app.haptics.runtime.servo import Servo

    servo = Servo(device, clock=VirtualClock())
    touch = servo.telemetry.reader()
    servo.load(scene)
    servo.advance(800)
    touch.read()
    getattr(device, "hand", device).follow(*exploration(Random(9).random, HALF_M, lasting_s))  # noqa: S311
    rows = []
    for _ in range(round(10 * lasting_s)):
        for _ in range(100):
            servo.advance(1)
            if given_n is not None:
                given_n.append(device.hand.force_n)
        rows.append(np.asarray(touch.read()).copy())
    servo.stop()
    return np.concatenate(rows)


def emulated_falcon(**options: Any) -> Any:
    from study_app.devices.emulators.falcon import EmulatedFalcon
    from study_app.devices.emulators.falcon_emulator import Emulator

    return EmulatedFalcon(emulator=Emulator(running=True, workspace_m=HALF_M, **options))


def test_in_a_thick_liquid_the_force_is_that_of_the_path_all_along(monkeypatch: pytest.MonkeyPatch) -> None:
    """Averaged over 10 ms, which no hand tells apart, within 5 % or 0.05 N of what the exact path is felt as.

    Windows with a rejected sample do not count: the path sets out faster than a hand, so the exact device rejects it.
    """
    tie_hand(monkeypatch)
    scene = load(STUDY).scene_for("honey")
    exact = felt(scripted.ScriptedDevice(quantum_m=0.0, tremor_m=0.0, workspace_m=HALF_M), scene, 20.0)
    with emulated_falcon(tremor_m=0.0) as device:
        coarse = felt(device, scene, 20.0)
    window = np.ones(10) / 10
    one, other = (
        np.stack([np.convolve(rows["device_force_n"][:, axis], window, "valid") for axis in range(3)], axis=1)
        for rows in (exact, coarse)
    )
    off_n, size_n = np.linalg.norm(other - one, axis=1), np.linalg.norm(one, axis=1)
    rejected = (exact["limiters"] | coarse["limiters"]) & LIMITER_GLITCH != 0
    assert rejected.sum() <= 10
    counted = np.convolve(rejected, window, "valid") == 0
    assert size_n[counted].max() > 4.0
    assert (off_n <= np.maximum(0.05 * size_n, 0.05))[counted].all()


@pytest.mark.parametrize("condition", ["water", "honey"])
def test_a_minute_with_faulty_packets_has_no_jump_of_force_and_no_tick_unaccounted_for(condition: str) -> None:
    faults = ("drop", "truncate", "corrupt", "duplicate")
    given_n: list[Any] = []
    with emulated_falcon(random=Random(5)) as device:  # noqa: S311
        for fault in faults:
            device.hand.faults.chance(fault, 0.0025)
        samples = felt(device, load(STUDY).scene_for(condition), 60.0, given_n)
        counters = device.counters
        happened = {fault: device.hand.faults.happened(fault) for fault in faults}
    assert (samples["status"] == STATUS_OK).all()
    most_n = slew_limit_n(1e-3, device.dynamics)
    for forces_n in (samples["device_force_n"], np.array(given_n)):  # asked for, and made of it by the emulator
        assert np.linalg.norm(forces_n, axis=1).max() > 2.0
        assert np.linalg.norm(np.diff(forces_n, axis=0), axis=1).max() <= most_n + 0.02  # the mechanism ticks, too
    assert min(happened.values()) > 100
    assert counters["fresh"] > 0.98 * counters["ticks"] > 0.98 * 60_000
    assert counters["fresh"] + counters["missing"] + counters["late"] + counters["refused"] == counters["ticks"]
    assert counters["written_off"] - counters["surplus"] <= sum(happened.values())


def test_a_cable_pulled_in_a_trial_keeps_the_data_marks_the_trial_and_lets_it_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    look, looks = RehearsedSession.look, []

    def pull_the_cable(self: Any, senses: Any) -> Any:
        looks.append(self.page.trial)
        if looks.count(2) == 40:
            self.rig.device.hand.faults.on("unplugged")
        return look(self, senses)

    folder = StudyFolder(tmp_path / "demo")
    with monkeypatch.context() as patch:
        patch.setattr(RehearsedSession, "look", pull_the_cable)
        with pytest.raises(SessionError, match="'falcon-emulated' stopped: it was disconnected during use"):
            rehearsal.rehearse("demo", participants=1, seed=1, device="falcon-emulated", results=folder.path)
    (session,) = folder.sessions()
    rows = rows_of(session.table("demo", "trials"))
    assert [(row["trial"], row["outcome"]) for row in rows] == [("1", "complete"), ("2", "interrupted")]
    rehearsal.resume(session.path)  # a new Falcon is opened, and homed
    rows = rows_of(session.table("demo", "trials"))
    assert [(row["trial"], row["attempt"], row["outcome"]) for row in rows[:3]] == [
        ("1", "1", "complete"),
        ("2", "1", "interrupted"),
        ("2", "2", "complete"),
    ]
    assert {row["outcome"] for row in rows[3:]} == {"complete"}
    assert pyarrow.parquet.read_table(parquet_of(session.path / rows[1]["recording"])).num_rows > 1900


def test_only_a_device_that_moves_by_itself_can_be_rehearsed_on(tmp_path: Path) -> None:
    for device in ("mouse", "falcon"):
        with pytest.raises(SessionError, match=f"'{device}' waits for a person"):
            rehearsal.rehearse("demo", participants=1, seed=1, device=device, results=tmp_path / "demo")
    assert not (tmp_path / "demo").exists()
