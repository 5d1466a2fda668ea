"""Emulated devices compared with the scripted hand: in turn, by ratio and interval, with a verdict and an exit code."""

import threading
from contextlib import nullcontext
from typing import Any

import numba
import numpy as np
import pytest
from click.testing import CliRunner

if numba.config.DISABLE_JIT:
    pytest.skip("the servo exists compiled only", allow_module_level=True)

from study_app.cli import commands
from study_app.errors import StudyError
from study_app.validation.timing import device_lateness
from study_app.validation.timing.device_lateness import DeviceLateness, emulated_devices, text, time_devices
from study_app.validation.timing.loops import Taken

pytestmark = pytest.mark.slow


def times(monkeypatch: pytest.MonkeyPatch, factors: dict[str, Any]) -> list[str]:
    """Let the lateness with each device be random times its factor of the round; return the order of the loops."""
    order: list[str] = []
    rng = np.random.default_rng(3)

    class FakeLoop:
        def __init__(self, _grant: object, *, device: str, **_options: object) -> None:
            self.device, self.round = device, 0

        def run(self, ticks: int) -> Taken:
            order.append(self.device)
            self.round += 1
            lateness = rng.gamma(2.0, 10_000.0, ticks) * factors[self.device](self.round)
            return Taken(lateness.astype(np.int64), np.zeros(0, np.int64), 0)

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


def test_it_ends_when_it_is_asked_to_and_refuses_too_short_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    order = times(monkeypatch, {"scripted": lambda _: 1.0})
    ending = threading.Event()
    ending.set()
    with pytest.raises(KeyboardInterrupt):
        time_devices(2.0, ["scripted"], ending=ending)
    assert order == []
    with pytest.raises(StudyError, match=r"for 0\.5 to 3600 s, not 0\.1"):
        time_devices(0.1, ["scripted"], ending=threading.Event())


def test_every_emulated_device_is_compared() -> None:
    names = emulated_devices()
    assert names[0] == "scripted"
    assert {"falcon-emulated", "inverse3-emulated", "force-dimension-emulated"} <= set(names)


@pytest.mark.parametrize(("low", "exit_code"), [(1.2, 0), (1.6, 3)])
def test_the_command_prints_ratios_and_ends_with_3_where_one_is_missed(
    low: float, exit_code: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Any
) -> None:
    found = (
        DeviceLateness("scripted", 1000, 20.0, 50.0, 1.0, 1.0, 1.0),
        DeviceLateness("falcon-emulated", 1000, 25.0, 95.0, 1.9, low, 2.5),
    )
    monkeypatch.setattr(device_lateness, "time_devices", lambda *_, **__: found)
    done = CliRunner().invoke(commands, ["timing", "--devices", "--to", str(tmp_path / "out")])
    assert done.exit_code == exit_code
    assert f"1.90 ({low:.2f} to 2.50): {'missed' if exit_code else 'undecided'}" in done.output
    assert (tmp_path / "out" / "devices.txt").read_text(encoding="utf-8") == text(found)


@pytest.mark.parametrize("other", [["--delays"], ["--spin", "50"]])
def test_options_of_other_measurements_are_refused(other: list[str]) -> None:
    refused = CliRunner().invoke(commands, ["timing", "--devices", *other])
    assert refused.exit_code != 0
    assert "--spin applies" in str(refused.exception) or "exclude each other" in refused.output
