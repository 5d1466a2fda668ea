"""A small study whose conditions can be recognised anywhere, and a session that answers it."""

import itertools
import tomllib
from collections.abc import Callable
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from study_app.haptics.model.layout import LIMITER_NAMES, SAMPLE
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.store.journals import journal_events
from study_app.store.journals.journal import SessionClock
from study_app.store.sessions.open_session import SessionStore
from tests import studies
from tests.journal_lines import event_of
from tests.protocol.edited_studies import text_of

AWKWARD = 'comma, "quote",\nnew line\r\n\ttab 🌊 \u2028\x85 =SUM(A1)' + "é" * 10_000

SOURCE = b"[study]\nname = 'brackish'\n"


Start = Callable[..., SessionStore]
Attend = Callable[[SessionStore], None]
Make = Callable[..., np.ndarray[Any, Any]]
Tables = Callable[..., dict[str, Any]]


def study_tables(**changes: Any) -> dict[str, Any]:
    """A protocol file's tables; ids and numbers of the conditions occur nowhere else by chance."""
    return tomllib.loads(text_of("brackish")) | changes


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(autouse=True)
def _no_plug_is_pulled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Skip fsync in all tests but those of waiting for the disk."""
    monkeypatch.setattr("os.fsync", lambda _: None)


@pytest.fixture
def tables_of_study() -> Tables:
    return study_tables


@pytest.fixture
def protocol() -> Protocol:
    return Protocol.model_validate(study_tables())


def ticking_clock() -> SessionClock:
    """Return a clock that advances by a millisecond with each reading."""
    ticks = itertools.count(5_000_000_000, 1_000_000)
    origin = datetime(2026, 3, 1, 10, 0, tzinfo=timezone(timedelta(hours=1)))
    return SessionClock(lambda: next(ticks), origin)


@pytest.fixture
def clock() -> SessionClock:
    return ticking_clock()


def begun(
    results: Path,
    participant: str = "P007",
    *,
    protocol: Protocol | None = None,
    source: bytes = SOURCE,
    clock: SessionClock | None = None,
    **given: Any,
) -> SessionStore:
    """Begin a session in a study's folder; any value of its ``SessionStart`` can be given."""
    values: dict[str, Any] = {
        "seed": 11,
        "operator": "AB",
        "device": {"name": "scripted", "rate_hz": 1000},
        "screens": {"participant": {"width": 1920, "height": 1080, "refresh_hz": 60.0}},
    }
    study = protocol or Protocol.model_validate(study_tables())
    return studies.begun(results, participant, study, source, clock=clock or ticking_clock(), **(values | given))


@pytest.fixture
def start(tmp_path: Path, protocol: Protocol, clock: SessionClock) -> Start:
    """Begin a session of P007 in tmp_path/study; any argument of ``begun`` can be given."""

    def begin_one(participant: str = "P007", **given: Any) -> SessionStore:
        return begun(
            participant=participant, **({"results": tmp_path / "study", "protocol": protocol, "clock": clock} | given)
        )

    return begin_one


def choose(store: SessionStore, trial: int, items: list[dict[str, Any]]) -> None:
    """Journal the choices that lead to the answers ``items``."""
    for item in items:
        which = {"trial": trial, "item": item["item"]}
        store.append(journal_events.ItemShown(**which), t_s=item["onset_s"])
        store.append(journal_events.Choice(value=item["value"], **which), t_s=item["first_s"])


def summary_of_trial() -> dict[str, Any]:
    return {
        "duration_s": 9.0,
        "targets_reached": None,
        "targets": None,
        "ticks": 9000,
        "tick_rate_hz": 999.98,
        "lateness_p99_ms": 0.125,
        "worst_gap_ms": 1.5,
        "overruns": 0,
        "samples_dropped": 0,
        "path_length_m": 1.25,
        "mean_speed_mps": 0.1389,
        "force_mean_n": 0.1 + 0.2,
        "force_peak_n": 2.5,
        **{f"limiter_{name}": 0 for name in LIMITER_NAMES},
        "frames": 540,
        "frames_late": 2,
        "delay_error_mean_ms": 8.25,
        "delay_error_p95_ms": 16.5,
        "delay_error_max_ms": 17.0,
    }


@pytest.fixture
def summary() -> dict[str, Any]:
    return summary_of_trial()


def attended(store: SessionStore, protocol: Protocol | None = None) -> None:
    """Journal a whole session as the session's state machine does."""
    for trial in build_schedule(protocol or Protocol.model_validate(study_tables()), "P007", 11).trials:
        which = {"trial": trial.number, "attempt": 1}
        fields = {name: getattr(trial, name) for name in ("block", "phase", "part", "index", "of", "code")}
        store.append(journal_events.TrialStarted(**which, **fields))
        store.append(event_of("trial_ended", **which, outcome="complete", **summary_of_trial()))
        store.write_tables()
        if trial.items:
            fields = {"onset_s": 1.5, "first_s": 2.25, "last_s": 2.25, "changes": 0}
            items = [
                {"item": item, "number": number, "value": 1 + (trial.number + number) % 7, **fields}
                for number, item in enumerate(trial.items, start=1)
            ]
            choose(store, trial.number, items)
            store.append(event_of("responses", **which, items=items))
            store.write_tables()


@pytest.fixture
def attend(protocol: Protocol) -> Attend:
    """Walk a session through its schedule, up to the end."""
    return lambda store: attended(store, protocol)


@pytest.fixture
def finished(start: Start, attend: Attend) -> Start:
    """Begin a session, answer everything and complete it; any argument of ``start`` can be given."""

    def completed(participant: str = "P007", **given: Any) -> SessionStore:
        store = start(participant, **given)
        attend(store)
        store.finish("completed")
        return store

    return completed


def made_samples(count: int, *, first_tick: int = 0, scene: int = 1, seed: int = 5) -> np.ndarray[Any, Any]:
    """A hand that wanders, with a servo that is late by different amounts; numbers as full of digits as they can be."""
    generator = np.random.default_rng(seed)
    samples = np.zeros(count, SAMPLE)
    t_s = (first_tick + np.arange(count)) / 1000
    samples["tick"] = first_tick + np.arange(count)
    samples["lateness_ns"] = (90_000 * generator.lognormal(0.0, 0.6, count)).astype(np.int64)
    samples["time_ns"] = 10**15 + samples["tick"] * 1_000_000 + samples["lateness_ns"]
    for axis in range(3):
        phase, rate = generator.uniform(0, 6), generator.uniform(0.5, 2.0)
        samples["position_m"][:, axis] = 0.04 * np.sin(rate * t_s + phase) + generator.normal(0, 1e-6, count)
        samples["velocity_mps"][:, axis] = 0.4 * np.cos(rate * t_s + phase) + generator.normal(0, 1e-3, count)
        samples["wake_mps"][:, axis] = 0.3 * np.cos(rate * t_s + phase + 0.2)
        samples["force_n"][:, axis] = 4 * np.cos(rate * t_s + phase) + generator.normal(0, 1e-2, count)
    samples["device_force_n"] = samples["force_n"]
    limited = generator.random(count) < 0.1
    samples["device_force_n"][limited] *= 0.8
    samples["command_n"] = samples["device_force_n"]
    samples["limiters"][limited] = 8
    samples["fresh"] = generator.random(count) < 0.9
    samples["buttons"] = np.arange(count) // 700 % 16
    samples["scene"] = scene
    return samples


@pytest.fixture
def samples_of() -> Make:
    return made_samples


@pytest.fixture
def results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the results folder of the workspace."""
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    return tmp_path / "results"
