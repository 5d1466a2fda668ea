"""The thesis' study on each emulated device, through all of its driver: the same forces as on the scripted hand."""

import csv
import json
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
from study_app.store.files.folders import StudyFolder
from study_app.store.unblinding import unblind
from study_app.store.verification.whole_study import verify_study
from tests.compiled import needs_servo
from tests.store.forging import parquet_of

pytestmark = [pytest.mark.nightly, needs_servo, pytest.mark.slow]

STUDY = "rek2024"
HALF_M = (0.05, 0.03, 0.03)
LEAD_S = 0.5
FOLLOW = HandOrders.follow


def tie_hand(patch: pytest.MonkeyPatch) -> None:
    """Tie the simulated hand to its path, so that no force moves it."""
    patch.setattr(scripted, "STIFFNESS_NPM", 1e6)
    patch.setattr(scripted, "DAMPING_NSPM", 2e3)


def follow_from_here(hand: HandOrders, t_s: Any, position_m: Any) -> None:
    """Follow a path, but come onto it from where the hand is: a tied hand would leap, and the force with it."""
    times, places = np.asarray(t_s, np.float64), np.asarray(position_m, np.float64)
    share = np.clip((times - times[0]) / LEAD_S, 0.0, 1.0)
    left = 1.0 - share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    FOLLOW(hand, times, places + left[:, np.newaxis] * (np.array(hand.aim_m) - places[0]))


RECEIPTS: dict[str, dict[str, Any]] = {
    "falcon-emulated": {"calibration": "none", "firmware": "already running"},
    "inverse3-emulated": {"force_scale": 1.0},
    "force-dimension-emulated": {"system": "emulated"},
}
"""What a device's receipt says."""


@dataclass(frozen=True)
class Rehearsed:
    """The study on the scripted hand and on a device, unblinded: one seed, a tied hand."""

    device: str
    by_script: StudyFolder
    by_device: StudyFolder


@pytest.fixture(scope="module", params=RECEIPTS)
def rehearsed(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Rehearsed:
    folders = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LIQUID_STUDY_CONFIG", str(tmp_path_factory.mktemp("settings")))
        tie_hand(patch)
        if request.param == "inverse3-emulated":
            patch.setattr(HandOrders, "follow", follow_from_here)
        if request.param != "force-dimension-emulated":
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


def test_the_study_verifies_and_its_receipt_names_the_device(rehearsed: Rehearsed) -> None:
    folder = rehearsed.by_device
    assert verify_study(folder.path).errors == ()
    receipt = json.loads(folder.sessions()[0].receipt.read_text("utf-8"))["device"]
    assert receipt["name"] == rehearsed.device
    assert receipt.items() >= RECEIPTS[rehearsed.device].items()
    for study_folder in (rehearsed.by_script, folder):
        trials = table(study_folder, "trials")
        assert {(row["valid"], row["simulated"], row["outcome"]) for row in trials} == {("true", "true", "complete")}


def test_mean_forces_of_each_trial_equal_those_of_the_path(rehearsed: Rehearsed) -> None:
    """Single ticks differ because of the encoders' finite counts."""
    rows, others = (table(folder, "trials") for folder in (rehearsed.by_script, rehearsed.by_device))
    for row, other in zip(rows, others, strict=True):
        force_n = float(row["force_mean_n"])
        assert float(other["force_mean_n"]) == pytest.approx(force_n, abs=max(0.05 * force_n, 0.05))


def explored_samples(device: Any, scene: Any, lasting_s: float, given_n: list[Any] | None = None) -> Any:
    """Return all samples of a device whose hand explores a scene; append the force of its motors to ``given_n``."""
    from study_app.haptics.runtime.clocks import VirtualClock
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


def test_in_a_thick_liquid_the_force_equals_that_of_the_path_throughout(monkeypatch: pytest.MonkeyPatch) -> None:
    """Averages over 10 ms are within 5 % or 0.05 N of the force of the exact path.

    Windows with a rejected sample do not count: the path sets out faster than a hand, so the exact device rejects it.
    """
    tie_hand(monkeypatch)
    scene = load(STUDY).scene_for("honey")
    exact = explored_samples(scripted.ScriptedDevice(quantum_m=0.0, tremor_m=0.0, workspace_m=HALF_M), scene, 20.0)
    with emulated_falcon(tremor_m=0.0) as device:
        coarse = explored_samples(device, scene, 20.0)
    window = np.ones(10) / 10
    exact_n, coarse_n = (
        np.stack([np.convolve(rows["device_force_n"][:, axis], window, "valid") for axis in range(3)], axis=1)
        for rows in (exact, coarse)
    )
    off_n, size_n = np.linalg.norm(coarse_n - exact_n, axis=1), np.linalg.norm(exact_n, axis=1)
    rejected = (exact["limiters"] | coarse["limiters"]) & LIMITER_GLITCH != 0
    assert rejected.sum() <= 10
    compared = np.convolve(rejected, window, "valid") == 0
    assert size_n[compared].max() > 4.0
    assert (off_n <= np.maximum(0.05 * size_n, 0.05))[compared].all()


@pytest.mark.parametrize("condition", ["water", "honey"])
def test_faulty_packets_cause_neither_force_jumps_nor_uncounted_ticks(condition: str) -> None:
    faults = ("drop", "truncate", "corrupt", "duplicate")
    given_n: list[Any] = []
    with emulated_falcon(random=Random(5)) as device:  # noqa: S311
        for fault in faults:
            device.hand.faults.chance(fault, 0.0025)
        samples = explored_samples(device, load(STUDY).scene_for(condition), 60.0, given_n)
        counters = device.counters
        happened = {fault: device.hand.faults.occurrences(fault) for fault in faults}
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
    rehearsal.resume_rehearsal(session.path)  # a new Falcon is opened, and homed
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
