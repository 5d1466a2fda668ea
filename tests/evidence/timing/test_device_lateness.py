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
from study_app.evidence.timing.device_lateness import emulated_devices, time_devices
from study_app.evidence.timing.measurement import Ticks

pytestmark = pytest.mark.slow


def times(monkeypatch: pytest.MonkeyPatch, factors: dict[str, Any]) -> list[str]:
    """Let the lateness with each device be random times its factor of the round; return the order of the loops."""
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
    assert like.verdict == "met"
    assert 0.8 < like.low < like.ratio < like.high < 1.3
    assert slow.ratio == pytest.approx(2.0, abs=0.2)
    assert slow.verdict == "missed"
    assert shaky.ratio > 1.5 > shaky.low
    assert shaky.verdict == "undecided: measure for longer"


def test_every_emulated_device_is_compared() -> None:
    names = emulated_devices()
    assert names[0] == "scripted"
    assert {"falcon-emulated", "inverse3-emulated", "force-dimension-emulated"} <= set(names)
