"""When targets were reached is sealed: while the study is blinded the journal says neither when nor how many."""

from pathlib import Path
from typing import Any

import pytest

from study_app.store.blinded.blinding import open_events, read_key
from study_app.store.journals import journal
from study_app.store.journals.journal_events import Event, IntervalEnded, TargetReached, TrialEnded
from tests.journal_lines import event_of
from tests.outlets.collector import Collector
from tests.store.conftest import Start, ticking_clock

ABOUT: dict[str, Any] = {"block": "b", "phase": "main", "part": 1, "of": 2, "code": "L1", "index": 1}


def lines_of(start: Start, reached_s: list[float], *, outlets: Collector | None = None) -> tuple[list[Event], Path]:
    """Return the journal of a session of one trial in which targets were reached at these times."""
    store = start(clock=ticking_clock(), simulated=True)
    if outlets is not None:
        store.attach(outlets)
    store.append(event_of("trial_started", trial=1, attempt=1, **ABOUT))
    for number, at_s in enumerate(reached_s):
        store.append(event_of("target_reached", trial=1, target=number % 2, t_task_s=at_s))
    store.append(event_of("trial_ended", trial=1, attempt=1, outcome="complete", targets_reached=len(reached_s)))
    store.finish("completed")
    return list(journal.read(store.folder.journal)), store.place.study_folder.path


@pytest.mark.parametrize("count", [0, 1, 7, 120])
def test_journals_look_alike_however_many_targets_were_reached(start: Start, count: int) -> None:
    lines, _ = lines_of(start, [0.25 + 0.37 * number for number in range(count)])
    assert [line.event for line in lines] == ["session_started", "trial_started", "trial_ended", "session_ended"]
    (ended,) = (line for line in lines if isinstance(line, TrialEnded))
    assert ended.reached_s is None
    assert ended.others.get("targets_reached") is None
    assert len(ended.sealed or "") == 2 * (16 + 4096)


def test_the_key_opens_their_times(start: Start) -> None:
    times_s = [0.731, 1.482, 2.113004]
    lines, folder = lines_of(start, times_s)
    (ended,) = (line for line in open_events(lines, read_key(folder)) if isinstance(line, TrialEnded))
    assert ended.reached_s == times_s
    assert ended.others["targets_reached"] == 3


def test_each_interval_has_its_own_times(start: Start) -> None:
    store = start(clock=ticking_clock(), simulated=True)
    store.append(event_of("trial_started", trial=1, attempt=1, **ABOUT))
    for interval, at_s in ((1, 0.811), (2, 1.922)):
        store.append(event_of("interval_started", trial=1, attempt=1, interval=interval))
        store.append(event_of("target_reached", trial=1, target=0, t_task_s=at_s))
        store.append(event_of("interval_ended", trial=1, attempt=1, interval=interval, outcome="complete"))
    lines = open_events(store.lines, store.key)
    store.close()
    assert [line.reached_s for line in lines if isinstance(line, IntervalEnded)] == [[0.811], [1.922]]
    assert not any(isinstance(line, TargetReached) for line in lines)
