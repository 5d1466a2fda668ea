"""Two programs want the same id at the same moment, a hundred times over: one gets it, the other is told."""

import multiprocessing
import os
from pathlib import Path
from typing import Any

import pytest

from study_app.errors import StoreError
from study_app.store.folders import StudyFolder
from study_app.store.sessions.begin import SessionStart, begin
from study_app.store.verification.verify_study import verify
from tests.platforms import needs_fork
from tests.session import small

TIMES = 100

pytestmark = [pytest.mark.slow, needs_fork]


def race(folder: Path, start: Any, won: Any) -> None:
    """Try to begin each session when the other does."""
    taken = []
    for number in range(1, TIMES + 1):
        start.wait(60)
        try:
            store = begin(
                folder,
                small.protocol(),
                b"small",
                SessionStart(
                    f"P{number:03d}",
                    seed=1,
                    operator=str(os.getpid()),
                    language="en",
                    device={"name": "memory"},
                    screens={},
                    simulated=False,
                ),
            )
        except StoreError as error:
            taken.append((number, str(error)))
        else:
            store.close()
            taken.append((number, ""))
    won.put(taken)


def test_of_two_programs_exactly_one_gets_each_id(tmp_path: Path) -> None:
    forking = multiprocessing.get_context("fork")
    start, won = forking.Barrier(2), forking.Queue()
    programs = [forking.Process(target=race, args=(tmp_path / "study", start, won)) for _ in range(2)]
    for program in programs:
        program.start()
    one, other = won.get(timeout=120), won.get(timeout=120)
    for program in programs:
        program.join(30)
        assert program.exitcode == 0
    for (number, first), (_, second) in zip(one, other, strict=True):
        refused = first or second
        assert not (first and second), number
        assert first or second, number
        assert "already has session 1" in refused, refused
        assert "nothing was changed" in refused
    study = StudyFolder(tmp_path / "study")
    assert len(study.sessions()) == TIMES
    assert verify(study.path).errors == ()
