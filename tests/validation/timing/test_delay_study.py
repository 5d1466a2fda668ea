"""What is said of delays: errors from sample to painting, in ms and in frames, in words, tables and a figure."""

import numpy as np
import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.validation.timing.delay_report import write
from study_app.validation.timing.delay_results import Delayed, Shown

MS = 1_000_000


def shown(errors_ms, *, hz=60.0, delay_s=0.1, load="none", periods=None):
    """Return frames with these errors, each a period after the one before unless told."""
    errors_ns = np.rint(np.asarray(errors_ms) * MS).astype(np.int64)
    places = np.arange(len(errors_ns)) if periods is None else np.cumsum([0, *periods])
    painted_ns = np.rint(places * 1e9 / hz).astype(np.int64) + 5_000 * MS
    sample_ns = painted_ns - errors_ns - round(delay_s * 1e9)
    return Shown(f"virtual, {hz:g} Hz", "by the clock", load, hz, delay_s, painted_ns, sample_ns)


def found(*trials):
    return Delayed("a machine, 2 cores", 10.0, (1920, 1080), trials)


WELL = found(
    *(
        shown(np.full(200, 3.0), hz=hz, delay_s=delay_s, load=load)
        for hz in (60.0, 144.0)
        for load in ("none", "gui+cpu")
        for delay_s in (0.2, 0.0)
    )
)


@pytest.mark.parametrize(
    ("errors_ms", "held"),
    [
        (np.full(1000, 8.2), True),
        (np.full(1000, 8.4), False),
        (np.where(np.arange(1000) < 12, 17.0, 3.0), False),
        (np.where(np.arange(1000) < 8, 17.0, 3.0), True),
        (np.full(1000, -8.4), False),
    ],
)
def test_each_limit_can_be_missed(errors_ms, held):
    assert shown(errors_ms).held == held
    (said,) = found(shown(errors_ms)).limits()
    assert said.endswith("met" if held else "missed")


def test_one_trial_that_missed_it_is_enough():
    limits = found(*WELL.shown, shown(np.full(200, 9.0), hz=60.0, delay_s=0.1, load="gui+cpu")).limits()
    assert [said.rsplit(": ", 1)[1] for said in limits] == ["met", "missed", "met", "met"]
    assert "means within 6.00 ms of each other" in limits[1]


@pytest.mark.slow
def test_files_are_written_and_the_figure_is_the_same_each_time(tmp_path):
    files = write(WELL, tmp_path)
    assert [file.name for file in files] == [f"delays.{kind}" for kind in ("txt", "md", "csv", "png", "svg")]
    first = [file.read_bytes() for file in files]
    assert [file.read_bytes() for file in write(WELL, tmp_path)] == first
    assert b"1 frame" in files[-1].read_bytes()


def test_delays_have_no_loops_to_spin():
    finished = CliRunner().invoke(commands, ["timing", "--delays", "--spin", "100"])
    assert "omit it with --delays" in str(finished.exception)
