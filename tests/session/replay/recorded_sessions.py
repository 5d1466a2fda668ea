"""Sessions that replay computes again, and how their recordings are changed."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
from pyarrow import parquet

from study_app.devices.rig import Rig
from study_app.devices.simulated import ScriptedDevice
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.session.pages import Page, TaskPage
from study_app.session.ports import Ports
from study_app.session.resume import resume_at
from study_app.session.runner import Runner
from study_app.session.transitions.events import (
    Begin,
    Continue,
    EndRequested,
    ForceStopped,
    PauseRequested,
    RepeatRequested,
    ResumeRequested,
)
from study_app.store.files.folders import StudyFolder
from study_app.store.journals.journal import SessionClock
from study_app.store.sessions.open_session import SessionStore
from tests import studies
from tests.session import small
from tests.store.forging import parquet_of

STRESSED: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "honey": (
        {"scale": 3, "velocity": {"kind": "kalman"}, "body": {"diameter_m": 0.068, "density_kg_m3": 1000}},
        {"density_kg_m3": 1420, "viscosity_pa_s": 10, "effects": ["buoyancy", "unsteady_drag"]},
    ),
    "light_oil": (
        {"scale": 10, "velocity": {"kind": "ewma"}},
        {"density_kg_m3": 4500, "effects": ["drag", "added_mass", "wake"], "wake": {"length": 125, "scaling": 250}},
    ),
}
"""Scene and liquid of studies on which limits and passivity controller act."""


def begun(folder: Path, device: ScriptedDevice, servo: Servo, study: Protocol | None = None) -> SessionStore:
    who = {"device": Rig(device, servo).described, "simulated": True, "recordings": True}
    clock = SessionClock(servo.now_ns)
    return studies.begun(folder, "P001", study or small.protocol(), b"small", clock=clock, **who)


def held(
    store: SessionStore, device: ScriptedDevice, servo: Servo, study: Protocol | None = None
) -> tuple[Runner, Callable[[int], None]]:
    """Return the runner of a session in which a hand moves, and what lets ticks pass."""
    study, t_s = study or small.protocol(), np.arange(0, 60, 0.005)
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
            runner.post(RepeatRequested(clock.seconds(), "a sneeze"))  # from one force into the next
            wait(850)
            servo.advance(7)
            runner.post(RepeatRequested(clock.seconds(), "another"))
            wait(900)
            runner.post(ForceStopped(clock.seconds(), "operator"))
            wait(300)
            runner.post(ResumeRequested(clock.seconds(), "operator"))
            wait(800)
            runner.post(PauseRequested(clock.seconds(), "operator"))
            wait(2000)
            runner.post(ResumeRequested(clock.seconds(), "operator"))
            wait(1500)
            runner.post(EndRequested(clock.seconds(), "aborted", ""))
            place: Path = store.folder.path
    return place


def stressed(folder: Path, liquid: str) -> Path:
    """Hold a session in which a hand shakes and then stirs a liquid of `STRESSED`; return its folder.

    A force acts two ticks late, later three; single positions are 5 mm off.
    """
    scene, made_of = STRESSED[liquid]
    explore = {**small.TABLES["tasks"]["explore"], "min_s": 5, "max_s": 6}
    study = Protocol.model_validate(
        small.TABLES
        | {"format": 2, "scene": scene, "liquids": dict.fromkeys(("thin", "thick"), made_of)}
        | {"tasks": {**small.TABLES["tasks"], "explore": explore}}
    )
    device = ScriptedDevice()
    handle = device.state.handle
    handle.delay = 2
    with (
        device,
        Servo(device, clock=VirtualClock(), elements=200) as servo,
        begun(folder, device, servo, study) as store,
    ):
        runner, wait = held(store, device, servo, study)
        t_s = np.arange(0, 10, 0.001)
        along_m = np.where(t_s < 1.2, 0.03 * np.sin(10 * np.pi * t_s), 0.02 * np.sin(3.2 * np.pi * t_s))
        device.follow(t_s, np.column_stack((along_m, 0.005 * np.cos(9 * t_s), 0 * t_s)))
        runner.post(Begin(store.clock.seconds()))
        wait(100)
        runner.post(Continue(store.clock.seconds()))
        wait(2300)
        for _ in range(3):
            handle.position_m[0] += 0.005
            servo.advance(1)
            handle.position_m[0] -= 0.005
            wait(300)
        handle.delay = 3
        wait(600)
        runner.post(EndRequested(store.clock.seconds(), "aborted", ""))
        place: Path = store.folder.path
    return place


def session(results: Path) -> Path:
    return StudyFolder(results).sessions()[0].path


def rewrite(path: Path, change: Callable[[dict[str, Any]], None]) -> None:
    """Change the columns of a recording and keep its checks, as a mistake or a forger would."""
    facts = parquet.read_metadata(parquet_of(path)).metadata[b"liquid_study"]
    table = parquet.read_table(parquet_of(path))
    columns = {name: table.column(name).to_numpy().copy() for name in table.column_names}
    change(columns)
    with parquet.ParquetWriter(path, table.schema) as writer:
        writer.write_table(pa.table(columns, schema=table.schema))
        writer.add_key_value_metadata({b"liquid_study": facts})
