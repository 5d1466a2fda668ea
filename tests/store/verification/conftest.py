"""A study of two finished sessions."""

from pathlib import Path
from typing import Any

import pytest

from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.store.journals import journal_events
from tests.journal_lines import event_of
from tests.store.conftest import Attend, Make, Start, choose


@pytest.fixture
def study(
    tmp_path: Path, protocol: Protocol, start: Start, samples_of: Make, summary: dict[str, Any], attend: Attend
) -> Path:
    """Two finished sessions: P007 with recordings, one trial of it presented twice; P008 withdrawn."""
    store = start(recordings=True)
    recorder = store.recorder
    assert recorder is not None
    for trial in build_schedule(protocol, "P007", 11).trials:
        told = {name: getattr(trial, name) for name in ("block", "phase", "part", "index", "of", "code")}
        for attempt in (1, 2) if trial.number == 2 else (1,):
            store.append(journal_events.TrialStarted(trial=trial.number, attempt=attempt, **told))
            recorder.start(trial.number, attempt, 1000.0)
            recorder.append(samples_of(500 + trial.number))
            recorder.frame(9, 4)
            recorder.stop()
            store.append(event_of("trial_ended", trial=trial.number, attempt=attempt, outcome="complete", **summary))
        items = [
            {"item": item, "number": n, "value": 4, "onset_s": 1.5, "first_s": 2.25, "last_s": 2.25, "changes": 0}
            for n, item in enumerate(trial.items, start=1)
        ]
        if items:
            choose(store, trial.number, items)
            store.append(event_of("responses", trial=trial.number, attempt=attempt, items=items))
        store.write_tables()
    store.append(journal_events.Note(kind="mark", text='comma, "quote"\nnew line'))
    store.finish("completed")
    start("P008").finish("withdrawn", "tired")
    return tmp_path / "study"
