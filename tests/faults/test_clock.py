"""The wall clock is set back an hour: within a session nobody notices, and over a gap nothing goes back."""

from datetime import datetime, timedelta
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from study_app.session.transitions.state import Phase
from study_app.store import clock
from study_app.store.clock import SessionClock
from study_app.store.sessions import reopen as resume
from study_app.store.sessions.reopen import reopen
from study_app.store.verification.verify_study import verify
from tests.faults.support.worlds import StoredWorld
from tests.session import small

HOUR = timedelta(hours=1)


class Slow(datetime):
    """The system's clock after somebody set it back."""

    @classmethod
    def now(cls, tz: Any = None) -> Any:
        return datetime.now(tz) - HOUR


def set_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clock, "datetime", Slow)
    monkeypatch.setattr(resume, "datetime", Slow)


def never_goes_back(lines: Any) -> bool:
    return all(one["t_s"] <= two["t_s"] and one["at"] <= two["at"] for one, two in pairwise(lines))


@pytest.mark.slow
def test_within_a_session_times_go_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    world = StoredWorld(tmp_path / "study")
    world.start()
    world.until(Phase.ANSWERING)
    set_back(monkeypatch)
    world.until(Phase.COMPLETE)
    assert never_goes_back(world.lines)
    assert verify(tmp_path / "study").sound


def test_over_a_gap_the_gap_is_not_known_and_times_on_the_sessions_clock_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    world = StoredWorld(tmp_path / "study")
    world.start()
    world.until(Phase.ANSWERING)
    world.store.close()
    set_back(monkeypatch)
    ticks = SessionClock()
    again = reopen(
        world.store.folder.path,
        small.protocol(),
        b"small",
        operator="AK",
        device={"name": "memory"},
        screens={},
        now_ns=lambda: round(ticks.seconds() * 1e9),
    )
    again.append("note", kind="note", text="the clock was wrong")
    again.finish("withdrawn")
    lines = again.lines
    (resumed,) = [line for line in lines if line["event"] == "session_resumed"]
    assert resumed["gap_s"] is None
    assert all(one["t_s"] <= two["t_s"] for one, two in pairwise(lines))
    assert verify(tmp_path / "study").errors == ()
