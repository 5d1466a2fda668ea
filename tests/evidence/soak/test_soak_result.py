"""The verdict of a soak test by hand: each violation has its own sentence."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from study_app.devices.faulty import FAULTS, KINDS
from study_app.evidence.soak.result import Drift, Rests, SoakResult
from study_app.evidence.soak.sample_audit import _COUNTS
from study_app.haptics.model.layout import LIMITER_NAMES

COUNTS = {
    "limit_n": 8.0, "slew_n": 0.5, "samples": 990, "missing": 7, "overruns": 12, "refused": 13, "not_finite": 31,
    "displaced": 32, "silent": 33, "long_ticks": 34, "buttons": 35, "lost": 36, "lost_at_write": 37, "stale": 14,
    "steepest_n": 0.25, "release_step_n": 1.5, "energy_step_n": 0.75, "latest_s": 0.004, "first_tick": 77,
}  # fmt: skip
SEEN = {"non_finite": 31, "glitch": 32, "silence": 33, "clock_jump": 34, "stop_button": 35, "lost": 36,
        "lost_at_write": 37}  # fmt: skip


def record(kind: Any, values: dict[str, Any]) -> Any:
    row = np.zeros(1, kind).view(np.recarray)[0]
    for name, value in values.items():
        row[name] = value
    return row


def result(counts: dict[str, Any] | None = None, device: dict[str, Any] | None = None, **keys: Any) -> SoakResult:
    """Return a sound result, with changed counts, numbers of the device, or keys."""
    limiters = np.arange(101, 101 + len(LIMITER_NAMES))
    limiters[LIMITER_NAMES.index("non_finite")] = 0
    readings = [SEEN[name] for name in KINDS]
    numbers = {"most_n": 7.5, "writes": 1234, "episodes": np.arange(1, 1 + len(KINDS)), "injected": readings}
    sound = SoakResult(
        hours=0.5, virtual=True, seed=9, rate_hz=500.0, scenes=("water", "honey"), planned=2000, ticks=1000,
        took_s=0.25, memory=(2**20, 3 * 2**20, 5 * 2**20), drift=Drift(comparisons=21, worst=2e-10, longest_s=3.5),
        rests=Rests(count=22, pushed_s=0.125, force_n=1e-13), counts=record(_COUNTS, COUNTS | {"limiters": limiters}
        | (counts or {})), device=record(FAULTS, numbers | (device or {})), overruns=12, dropped=10, recoveries=15,
        loads=16, stops=17,
    )  # fmt: skip
    return replace(sound, **keys)


@pytest.mark.parametrize(
    ("counts", "device", "keys", "finding"),
    [
        ({"excess": 1}, {}, {}, "1 forces above the limit of 8 N, first at tick 77"),
        ({"no_number": 1}, {}, {}, "1 non-finite forces, first at tick 77"),
        ({"limiters": [name == "non_finite" for name in LIMITER_NAMES]}, {}, {}, "1 non-finite liquid forces"),
        ({}, {"not_finite": 1}, {}, "1 non-finite forces were written"),
        ({}, {"most_n": 8.25}, {}, "a force of 8.25 N was written"),
        ({"steps": 1}, {}, {}, "1 steps of up to 0.25 N, above the limit of 0.5 N, first at tick 77"),
        ({"unstopped": 1}, {}, {}, "1 forces other than zero while stopped, first at tick 77"),
        ({"accepted": 1}, {}, {}, "1 implausible readings accepted, first at tick 77"),
        ({"drift_ns": 1}, {}, {}, "the clock deviates from the ticks by up to 1 ns, first at tick 77"),
        ({}, {"last_n": (0.0, 0.5, 0.0)}, {}, "the last force written is [0.0, 0.5, 0.0] N, not zero"),
        ({}, {}, {"drift": Drift(worst=2e-9)}, "the wake deviates from its definition by 2e-09 of Σ|e|/S"),
        ({}, {}, {"drift": Drift(worst=math.nan)}, "the wake deviates from its definition by nan of Σ|e|/S"),
        ({}, {}, {"rests": Rests(wake_mps=1e-300)}, "a wake of 1e-300 m/s remains after a rest"),
        ({}, {}, {"rests": Rests(force_n=2e-12)}, "a force of 2e-12 N remains after a rest"),
        ({}, {}, {"memory": (2**20, 7 * 2**20)}, "memory grew by 6.0 MiB"),
        ({"samples": 989}, {}, {}, "1000 ticks do not equal 989 samples plus 10 dropped"),
        ({"missing": 11}, {}, {}, "1000 ticks do not equal 990 samples plus 10 dropped"),
        ({"samples": 1000, "overruns": 11, "missing": 0}, {}, {"dropped": 0}, "12 overruns, but the ticks imply 11"),
        ({"samples": 1000, "silent": 30, "missing": 0}, {}, {"dropped": 0},
         "33 readings of silence, but 30 in telemetry"),
    ],
)  # fmt: skip
def test_each_violation_is_one_sentence(
    counts: dict[str, Any], device: dict[str, Any], keys: dict[str, Any], finding: str
) -> None:
    wrong = result(counts, device, **keys)
    assert wrong.findings == (finding,)
    assert wrong.verdict == f"found: {finding}"
    assert wrong.evidence().missed


def test_values_at_their_limits_pass_and_jumps_count_only_in_virtual_time() -> None:
    most = result(
        memory=(2**20, 6 * 2**20), drift=Drift(worst=1e-9), rests=Rests(force_n=1e-12), planned=1000, ticks=1000
    )
    assert most.verdict == "passed: no faults found"
    real = result({"samples": 1000, "long_ticks": 30, "missing": 0}, virtual=False, dropped=0)
    assert real.findings == ()
    assert [fault.seen for fault in real.faults if fault.name == "clock_jump"] == [None]


def test_a_soak_that_was_cut_short_states_its_extent_and_speed() -> None:
    evidence = result().evidence()
    assert evidence.text.splitlines()[:3] == [
        "soak test of 0.5 h in virtual time at 500 Hz, seed 9",
        "liquids: water, honey",
        "1,000 of 2,000 ticks in 0.2 s, 8 times as fast as real time",
    ]
    assert evidence.text.splitlines()[-1] == "passed: no faults found in the 50.0 % that was run"
    assert evidence.files["soak.txt"] == evidence.text
    assert evidence.files["soak.json"].startswith("{\n")
    assert "times as fast" not in result(virtual=False).text()
    assert ", 0 times as fast" in result(took_s=0.0).text()
