"""Emulated devices compared with the scripted hand: in turn, by ratio and interval, with a verdict."""

import threading
from contextlib import nullcontext
from typing import Any

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("the servo exists compiled only", allow_module_level=True)

from study_app.evidence.timing import device_lateness
from study_app.evidence.timing.device_lateness import emulated_devices, lateness_evidence, time_devices
from study_app.evidence.timing.measurement import Ticks

pytestmark = pytest.mark.slow


def times(monkeypatch: pytest.MonkeyPatch, factors: dict[str, Any]) -> list[str]:
    """Let the lateness with each device be random times its factor of the round; return the order of the loops.

    Its distribution is Erlang's with shape 2 and scale 10 µs: 1 − (1 + x) exp(−x) is 0.5 at x = 1.678, 0.99 at 6.638.
    """
    order: list[str] = []
    rng = np.random.default_rng(3)

    class FakeLoop:
        def __init__(self, _grant: object, *, device: str, **_options: object) -> None:
            self.device, self.round = device, 0

        def run(self, ticks: int) -> Ticks:
            order.append(self.device)
            self.round += 1
            lateness = rng.gamma(2.0, 10_000.0, ticks) * factors[self.device](self.round)
            return Ticks(lateness.astype(np.int64), np.zeros(0, np.int64), 0)

    monkeypatch.setattr(device_lateness, "ServoLoop", FakeLoop)
    monkeypatch.setattr(device_lateness, "open_device", nullcontext)
    return order


def test_devices_take_turns_and_are_compared_with_the_scripted_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    order = times(
        monkeypatch,
        {
            "scripted": lambda _: 1.0,
            "like": lambda _: 1.0,
            "slow": lambda _: 2.0,
            "shaky": lambda number: 1.0 if number % 4 else 4.0,
        },
    )
    names = ["scripted", "like", "slow", "shaky"]
    scripted, like, slow, shaky = time_devices(2.0, names, ending=threading.Event())
    assert order == names * 8
    assert (scripted.ratio, scripted.low, scripted.high) == (1.0, 1.0, 1.0)
    assert scripted.ticks == slow.ticks == 2000
    assert (slow.p50_us, slow.p99_us) == pytest.approx((2 * 16.78, 2 * 66.38), rel=0.15)
    assert like.verdict == "met"
    assert 0.8 < like.low < like.ratio < like.high < 1.3
    assert slow.ratio == pytest.approx(2.0, abs=0.2)
    assert slow.verdict == "missed"
    assert shaky.ratio > 1.5 > shaky.low
    assert shaky.verdict == "undecided: measure for longer"
    report = lateness_evidence((scripted, slow))
    rows = [line.split()[:4] for line in report.text.splitlines()[1:-1]]
    assert rows == [[it.name, "2000", f"{it.p50_us:.0f}", f"{it.p99_us:.0f}"] for it in (scripted, slow)]
    assert (report.files, report.missed) == ({"devices.txt": report.text}, True)
    assert not lateness_evidence((scripted, shaky)).missed


def test_every_emulated_device_is_compared() -> None:
    names = emulated_devices()
    assert names[0] == "scripted"
    assert {"falcon-emulated", "inverse3-emulated", "force-dimension-emulated"} <= set(names)
