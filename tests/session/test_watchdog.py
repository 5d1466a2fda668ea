"""What a session makes of a servo that stops itself, and what the hand feels of windows that stand still."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from study_app.haptics.model.layout import STATUS_OK
from study_app.session.pages import TroublePage
from study_app.session.transitions.state import Phase
from tests.compiled import needs_servo
from tests.session import small
from tests.session.runner.bench import Bench, small_bench

pytestmark = needs_servo

FRAME_TICKS = 16
SEEN_WITHIN_S = 0.1


@pytest.fixture
def bench() -> Iterator[Bench]:
    with small_bench() as new_bench:
        yield new_bench


def frames(bench: Bench, ticks: int) -> Any:
    """Let ticks pass while the windows look every frame; return the samples."""
    reader = bench.servo.telemetry.reader()
    for _ in range(0, ticks, FRAME_TICKS):
        bench.servo.advance(FRAME_TICKS)
        bench.runner.poll()
    return reader.read()


def fail_by_silence(bench: Bench) -> None:
    bench.device.state.last_ns = 1 << 62  # nothing newer than this ever comes


def fail_by_loss(bench: Bench) -> None:
    bench.device.unplug()


def fail_by_a_force_that_is_no_number(bench: Bench) -> None:
    for model in bench.servo.loop.slots:
        model.liquids.drag.factor_kg_m = np.nan


@pytest.mark.parametrize(
    ("fail", "said"),
    [
        (fail_by_silence, "no usable data for 50 ms"),
        (fail_by_loss, "stopped responding"),
        (fail_by_a_force_that_is_no_number, "non-finite force"),
    ],
)
def test_a_servo_that_faults_is_seen_within_100_ms_and_its_trial_is_marked(bench: Bench, fail: Any, said: str) -> None:
    clock: Any = bench.servo.loop.clock
    frames(bench, 800)
    assert bench.runner.state.phase is Phase.TASK
    trial = bench.runner.state.trial.number
    fail(bench)
    reader = bench.servo.telemetry.reader()
    noticed_s = None
    for _ in range(10):
        bench.servo.advance(FRAME_TICKS)
        clock.memory[0].now_ns += FRAME_TICKS * 1_000_000 if bench.servo.fault else 0  # the loop has ended
        bench.runner.poll()
        if bench.runner.state.phase is Phase.TROUBLE:
            noticed_s = bench.clock()
            break
    samples = reader.read()
    faulted_s = samples.time_ns[samples.status != STATUS_OK][0] * 1e-9
    assert noticed_s is not None
    assert noticed_s - faulted_s <= SEEN_WITHIN_S
    assert not bench.device.state.handle.force_n.any()
    assert isinstance(bench.pages[-1], TroublePage)
    (broke,) = bench.journal.of("broke")
    assert said in broke["what"]
    (row,) = bench.journal.of("trial_ended")
    assert (row["trial"], row["outcome"]) == (trial, "interrupted")


def forces_of_six_seconds(*, frozen: bool) -> Any:
    """Return the forces (n, 3) [N] of one hand, with windows that update every frame or freeze for 5 s."""
    with small_bench() as bench:
        servo, reader = bench.servo, bench.servo.telemetry.reader()
        frames(bench, 800)
        if frozen:
            servo.advance(5008)
        frames(bench, 320 if frozen else 5328)
        assert bench.runner.state.phase is Phase.TASK
        assert servo.fault is None
        samples = reader.read()
        assert reader.dropped == 0
        return samples.device_force_n


@pytest.mark.slow
def test_windows_frozen_for_five_seconds_do_not_change_the_force(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(small.TABLES["tasks"]["explore"], "max_s", 20)
    frozen, watched = forces_of_six_seconds(frozen=True), forces_of_six_seconds(frozen=False)
    assert len(frozen) == len(watched) == 6128
    assert np.abs(frozen[800:5808]).max() > 0.5
    assert frozen.tobytes() == watched.tobytes()
