"""Esc held on a real X server stops the force of the emulated Falcon; a held P pauses and does not resume."""

import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("PySide6.QtWidgets", reason="Qt's system libraries are missing", exc_type=ImportError)

from tests.compiled import needs_servo
from tests.end_to_end.held_escape import LabBench, SessionBench, count_stops, opened_bench
from tests.end_to_end.real_windows import needs_display, wait_for

pytestmark = [pytest.mark.slow, needs_servo, pytest.mark.xvfb, pytest.mark.timeout(300), needs_display]


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SessionBench]:
    with opened_bench(SessionBench, tmp_path_factory.mktemp("session")) as bench:
        assert isinstance(bench, SessionBench)
        yield bench


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[SessionBench | LabBench]:
    with opened_bench(LabBench, tmp_path) as bench:
        yield bench


@pytest.mark.parametrize("made", ["session", "lab"])
def test_escape_held_for_600_ms_stops_the_force_also_where_repeats_begin_before(
    request: pytest.FixtureRequest, made: str
) -> None:
    bench = request.getfixturevalue(made)
    assert count_stops(bench, 500, 2) == 2
    assert count_stops(bench, None, 1) == 1


def test_a_held_p_pauses_and_the_next_one_resumes(session: SessionBench) -> None:
    def counts() -> list[int]:
        return [len(session.program.events(kind)) for kind in ("paused", "resumed")]

    paused, resumed = counts()
    for setting in (("r", "on"), ("r", "rate", "200", "25")):
        subprocess.run(["xset", *setting], env=session.program.environment, check=True)
    session.xdotool("windowfocus", "--sync", session.operated, "keydown", "p")
    time.sleep(1.5)
    session.xdotool("keyup", "p")
    wait_for(lambda: counts()[0] > paused, "the pause")
    time.sleep(0.3)
    assert counts() == [paused + 1, resumed]
    session.xdotool("key", "p")
    wait_for(lambda: counts()[1] > resumed, "the session to go on")
    assert counts() == [paused + 1, resumed + 1]
