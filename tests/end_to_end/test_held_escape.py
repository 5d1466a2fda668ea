"""Esc held on a real X server stops the force of the emulated Falcon; a held P pauses and does not resume."""

import subprocess
import time
from pathlib import Path

import pytest

pytest.importorskip("PySide6.QtWidgets", reason="Qt's system libraries are missing", exc_type=ImportError)

from tests.compiled import needs_servo
from tests.end_to_end.held_escape import LabBench, SessionBench, count_stops, opened_bench
from tests.end_to_end.real_windows import needs_display, wait_for

pytestmark = [pytest.mark.slow, needs_servo, pytest.mark.xvfb, pytest.mark.timeout(300), needs_display]


@pytest.mark.parametrize("made", [SessionBench, LabBench])
def test_escape_held_for_600_ms_stops_the_force_also_where_repeats_begin_before(tmp_path: Path, made: type) -> None:
    with opened_bench(made, tmp_path) as bench:
        assert count_stops(bench, 500, 2) == 2
        assert count_stops(bench, None, 1) == 1


def test_a_held_p_pauses_and_the_next_one_resumes(tmp_path: Path) -> None:
    with opened_bench(SessionBench, tmp_path) as bench:
        assert isinstance(bench, SessionBench)
        subprocess.run(["xset", "r", "rate", "200", "25"], env=bench.program.environment, check=True)
        bench.xdotool("windowfocus", "--sync", bench.operated, "keydown", "p")
        time.sleep(1.5)
        bench.xdotool("keyup", "p")
        bench.program.wait_for_event("paused")
        time.sleep(0.3)
        assert [len(bench.program.events(kind)) for kind in ("paused", "resumed")] == [1, 0]
        bench.xdotool("key", "p")
        wait_for(lambda: bench.program.events("resumed"), "the session to go on")
        assert len(bench.program.events("paused")) == 1
