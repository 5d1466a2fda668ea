"""The wall clock is set back an hour within a session: nobody notices. Over a gap: tests/store/sessions."""

from datetime import datetime, timedelta
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from study_app.session.transitions.state import Phase
from study_app.store.journals import journal
from study_app.store.verification.verify_study import verify
from tests.faults.support.worlds import StoredWorld

HOUR = timedelta(hours=1)


class Slow(datetime):
    """The system's clock after somebody set it back."""

    @classmethod
    def now(cls, tz: Any = None) -> Any:
        return datetime.now(tz) - HOUR


@pytest.mark.slow
def test_within_a_session_times_go_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    world = StoredWorld(tmp_path / "study")
    world.start()
    world.until(Phase.ANSWERING)
    monkeypatch.setattr(journal, "datetime", Slow)
    world.until(Phase.COMPLETE)
    assert all(one["t_s"] <= two["t_s"] and one["at"] <= two["at"] for one, two in pairwise(world.lines))
    assert verify(tmp_path / "study").sound
