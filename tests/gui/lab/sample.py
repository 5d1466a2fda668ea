"""A sample lab: a ball moved offline through two liquids, A felt and B on the same motion."""

import dataclasses
import random
from dataclasses import dataclass
from typing import Any

import numpy as np

from study_app.gui.lab.lab_state import CostRow, DeviceShown, ErrorRow, LabView, Now
from study_app.haptics.kernels.safety import begin_scene, new_safety
from study_app.haptics.model.layout import SAMPLE, records
from study_app.haptics.model.scene import Scene
from study_app.haptics.runtime.offline import new_wake_places, recompute_sample
from study_app.haptics.runtime.pack import pack
from study_app.lab.ab_comparison import Setting, Workbench
from study_app.lab.live import LimiterCounts
from study_app.lab.presets import displayed_name
from study_app.lab.shadow import Shadow
from study_app.protocol.load import load_scene

RATE_HZ = 1000
ELEMENTS = 6000
REST_S = 0.3
# Corners of the hand's way [mm]: turns of more and of less than 45°, a drop that leaves no horizontal wake, an arc.
CORNERS = (
    (-42, 20, -20), (-42, 0, -20), (-40, 0, 10), (-6, -6, 20), (6, 0, 16), (13, 5, 5), (8, 10, -6),
    (44, 14, -16), (17, -2, 14),
)  # fmt: skip
LEG_S = (0.3, 0.35, 0.45, 0.16, 0.16, 0.16, 0.42, 0.40)


@dataclass(frozen=True)
class Choice:
    title: str


def hand() -> Any:
    """Return places (n, 3) [m] of a hand at 1 kHz: it slows at each corner that turns, and rests before the first."""
    corners = np.array(CORNERS) / 1000
    parts = [np.repeat(corners[:1], round(REST_S * RATE_HZ), axis=0)]
    for start, end, leg_s in zip(corners[:-1], corners[1:], LEG_S, strict=True):
        share = np.arange(1, round(leg_s * RATE_HZ) + 1) / round(leg_s * RATE_HZ)
        ease = share if leg_s < 0.2 else 0.5 - 0.5 * np.cos(np.pi * share)
        parts.append(start + ease[:, None] * (end - start))
    return np.concatenate(parts)[:-150]


def felt_samples(scene: Scene, hand_m: Any) -> Any:
    """Return telemetry of a servo that presents ``scene`` along a hand's way."""
    samples = records(SAMPLE, len(hand_m))
    samples.tick = np.arange(len(hand_m))
    samples.time_ns = 1_000_000_000 + samples.tick * (1_000_000_000 // RATE_HZ)
    samples.scene, samples.fresh = 1, 1
    samples.position_m = hand_m
    safety = new_safety(8.0)
    begin_scene(safety[0])
    trail, places = new_wake_places(ELEMENTS)
    recompute_sample(pack(scene, capacity=ELEMENTS), safety[0], samples, trail[0], places, True)
    return samples


def workbench(a: str = "water", b: str = "light_oil", **changes: float) -> Workbench:
    """Return a liquid, water edited by ``changes`` (of the wake), beside another."""
    scenes = {name: load_scene("rek2024", name) for name in (a, b)}
    bench = Workbench(*(Setting(displayed_name(name), scene, scene) for name, scene in scenes.items()))
    if a != "water":
        return bench
    for name, value in (changes or {"scaling": 2600.0, "exponent": 0.6, "breaking_angle_deg": 40.0}).items():
        bench = bench.change(f"wake.{name}", value)
    return bench


def still_view(bench: Workbench | None = None, **fields: Any) -> LabView:
    """Return the lab before anything has moved."""
    values: dict[str, Any] = {
        "workbench": bench or workbench(),
        "liquids": tuple(Choice(title) for title in ("Water", "Honey", "Light oil", "Syrup")),
        "device": DeviceShown(
            choices=(("mouse", "Mouse"), ("falcon", "Novint Falcon"), ("simulated", "Simulated")),
            chosen="mouse",
            pointer=True,
        ),
        "paths": (("circle", "Three circles, then a stop"), ("zigzag", "Turns of 90°")),
        "cost": (
            CostRow("Wake", 84.0),
            CostRow("Safety", 31.0),
            CostRow("Drag", 24.0),
            CostRow("Velocity", 18.0),
            CostRow("Tests", 4.0),
            CostRow("Buoyancy", None, "out, 0.00 N"),
            CostRow("Added mass", None, "not used"),
            CostRow("History", None, "not used"),
            CostRow("Current", None, "not used"),
        ),
        "tick_ns": 161.0,
        "errors": (
            ErrorRow(measure="Largest relative wake error", value="4e−15"),
            ErrorRow(measure="Largest force error", value="< 0.001 N"),
            ErrorRow(measure="Velocity filter lag", value="9 ms"),
        ),
        "limiters": LimiterCounts().rows(8.0, 1.5),
    }
    return LabView(**(values | fields))


def lab_view(bench: Workbench | None = None, *, cut: int | None = None, **fields: Any) -> LabView:
    """Return the lab at the end of the hand's way, or after ``cut`` ticks of it; compiled code alone is that quick."""
    bench = bench or workbench()
    rest = bench.a.scene.model_copy(update={"liquids": ()})
    shadow = Shadow(rest, ELEMENTS, 8.0)
    samples = felt_samples(bench.in_hand.scene, hand()[:cut])
    shadow.expect(1, bench.presented, bench.a.scene, bench.b.scene)
    shadow.process_samples(samples)
    counts = LimiterCounts()
    for first in range(0, len(samples), 33):
        counts.add(samples[first : first + 33])
    last = samples[-1]
    moved: dict[str, Any] = {
        "trace": shadow.trace(),
        "tail_a": shadow.tail("A"),
        "tail_b": shadow.tail("B"),
        "now": Now(
            position_m=tuple(last["position_m"].tolist()),
            force_n=tuple(last["device_force_n"].tolist()),
            wake_mps=tuple(last["wake_mps"].tolist()),
        ),
        "limiters": counts.rows(8.0, 1.5),
    }
    return still_view(bench, **(moved | fields))


def blind(bench: Workbench, *, first: str = "A", presented: str = "A") -> Workbench:
    drawn = bench.blinded(random.Random(1))  # noqa: S311 - drawn, then set
    return dataclasses.replace(drawn, first=first, presented=presented)  # type: ignore[arg-type]


def heard(place: Any, name: str) -> list[tuple[Any, ...]]:
    said: list[tuple[Any, ...]] = []
    place.asked.connect(lambda what, details: said.append(details) if what == name else None)
    return said
