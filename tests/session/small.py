"""A small study with everything a session can meet, and the steps to walk through it."""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from study_app.haptics.model.layout import SAMPLE
from study_app.haptics.runtime.grants import Grant
from study_app.haptics.runtime.telemetry import Timing
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule, draw_key, stream
from study_app.session.preflight import Measurements, Screen
from study_app.session.start import NewSession
from study_app.session.transitions.events import Begin, Chosen, Continue, ItemShown, Submitted, TaskDone
from study_app.session.transitions.state import Phase, SessionState
from study_app.session.transitions.table import advance, initial_state
from tests.protocol.edited_studies import text_of

WELL = Measurements(
    device="mouse",
    fresh_share=1.0,
    timing=Timing(ticks=2000, rate_hz=1000.0, lateness_p99_s=1e-4, worst_gap_s=2e-3, overruns=0),
    sample_age_s=0.001,
    screen=Screen(60.0, 1.0),
    probe_s=0.002,
    probe_fault="",
    free_bytes=10**10,
    participant="P007",
    recordings=True,
    grant=Grant("real-time", "SCHED_FIFO 60", locked=True),
)
"""What the pre-flight finds on a computer on which everything is well."""
CHOSEN = NewSession(
    source="demo",
    participant="P001",
    session=1,
    seed=7,
    operator="AK",
    language="en",
    device="mouse",
    windowed=True,
    screen=None,
    results=Path("nowhere"),
)
"""The choices for a first session, in a window."""

TABLES: dict[str, Any] = tomllib.loads(text_of("session"))
RESPONSES = 2 * 3 + 2 * 1


def protocol() -> Protocol:
    """Return the study as a value."""
    return Protocol.model_validate(TABLES)


def opened(seed: int = 1) -> SessionState:
    """Return a session before its first event."""
    study = protocol()
    return initial_state(study, build_schedule(study, "P001", seed), draw_key(study, stream(seed, "key").random), "en")


def next_event(state: SessionState, at_s: float) -> Any:
    """Return the event that advances a session without incidents by one step."""
    match state.phase:
        case Phase.OPENING:
            return Begin(at_s)
        case Phase.READING:
            return Continue(at_s)
        case Phase.TASK:
            return TaskDone(at_s, "complete", {"duration_s": 1.5})
        case Phase.ANSWERING:
            unseen = [item for item in state.trial.items if item not in state.answers]
            if unseen:
                return ItemShown(at_s, unseen[0])
            open_ = [item for item in state.trial.items if not state.answers[item].given]
            return Chosen(at_s, open_[0], 4) if open_ else Submitted(at_s)
        case _:
            raise AssertionError(state.phase)


def walk(state: SessionState, until: Phase, *, times: int = 1, at_s: float = 0.0) -> SessionState:
    """Walk on without incidents until ``until`` was entered ``times`` times."""
    while times:
        before = state.phase, state.index
        state, _ = advance(state, next_event(state, at_s))
        at_s += 1.0
        times -= state.phase is until and (state.phase, state.index) != before
    return state


def samples(times_s: Any, positions_m: Any, **fields: Any) -> Any:
    """Return telemetry: times (n,) [s], positions (n, 3) [m]; other fields as given."""
    times_s = np.asarray(times_s, np.float64)
    recording = np.zeros(len(times_s), SAMPLE).view(np.recarray)
    recording.time_ns = np.round(times_s * 1e9).astype(np.int64)
    recording.position_m = positions_m
    recording.fresh = 1
    for name, value in fields.items():
        recording[name] = value
    return recording
