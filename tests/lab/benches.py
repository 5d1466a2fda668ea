"""Helpers for tests of the lab: a workbench, and a servo on a manual clock."""

from random import Random

from study_app.devices.rig import Rig
from study_app.devices.simulated import ScriptedDevice
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo
from study_app.lab.ab_comparison import Setting, Workbench
from study_app.lab.live import Live
from study_app.protocol.load import load_scenes

SCENES = load_scenes("rek2024")


def bench(a: str = "water", b: str = "light_oil") -> Workbench:
    """Return two of the thesis' liquids side by side."""
    return Workbench(Setting(a, SCENES[a], SCENES[a]), Setting(b, SCENES[b], SCENES[b]))


def scripted() -> ScriptedDevice:
    """Return a scripted hand with reproducible tremor."""
    return ScriptedDevice(Random(1), workspace_m=(0.05, 0.03, 0.03))  # noqa: S311 - a hand keeps no secrets


def live_with(device: ScriptedDevice, *, elements: int = 10_000) -> Live:
    """Return the lab's device and servo, not begun."""
    return Live(Rig(device, Servo(device, clock=VirtualClock(), elements=elements)))


def run(live: Live, ticks: int, batch: int = 33) -> None:
    """Run this number of servo ticks, and poll the lab after every ``batch``."""
    for first in range(0, ticks, batch):
        live.servo.advance(min(batch, ticks - first))
        live.poll()
