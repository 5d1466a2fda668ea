"""Scenes that tests share (the thesis' liquids among them), and a hand that moves a model tick by tick."""

from typing import Any

import numba
import numpy as np

from study_app.haptics.kernels.compiled import entry_of
from study_app.haptics.kernels.safety import new_safety
from study_app.haptics.kernels.tick import compute_tick
from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics
from study_app.haptics.model.effects.current import Vortex
from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.effects.local_wake import LocalWake
from study_app.haptics.model.effects.wake import Wake
from study_app.haptics.model.force_rules import CURRENT, ForceRules
from study_app.haptics.model.layout import SAMPLE, records
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Box, Cylinder, Knee, Liquid, Scene
from study_app.haptics.runtime.pack import pack

COMPILED = not numba.config.DISABLE_JIT
TICK_NS = 1_000_000

# ½ ρ C_d A of the thesis' ball in 1000 kg/m³ [kg/m].
WATER_FACTOR = 0.5 * 1000 * 0.47 * np.pi * 0.034**2


def examples(count: int) -> int:
    """Return the number of examples to try: a tenth without compiled code."""
    return count if COMPILED else max(count // 10, 5)


def liquid(density_kg_m3: float = 1000.0, *, wake: dict[str, Any] | None = None, **fields: Any) -> Liquid:
    """Return a liquid with drag, and with a wake if its parameters are given."""
    effects = ("drag",) if wake is None else ("drag", "wake")
    return Liquid(
        **{
            "id": "liquid",
            "density_kg_m3": density_kg_m3,
            "effects": effects,
            "wake": None if wake is None else Wake(**wake),
            **fields,
        }
    )


def scene(*liquids: Liquid, **fields: Any) -> Scene:
    """Return a scene of these liquids; by default water with drag alone."""
    return Scene(**{"liquids": liquids or (liquid(),), **fields})


WATER = scene(liquid(1000, id="water", wake={"length": 1700, "scaling": 1700, "exponent": 0.75}))
HONEY = scene(liquid(1400, id="honey"))
LIGHT_OIL = scene(liquid(4500, id="light_oil", wake={"length": 125, "scaling": 250, "exponent": 0.25}))
THESIS = {"water": WATER, "honey": HONEY, "light_oil": LIGHT_OIL}
UNBENT = Knee(law="none")

# Every effect at once, in a pool that a hand leaves through its wall and its surface, over a bed that fades in.
ALL_EFFECTS = ("drag", "wake", "current", "buoyancy", "surface", "added_mass", "history")
POOL = Liquid(
    id="pool",
    density_kg_m3=1400,
    viscosity_pa_s=2.0,
    region=Cylinder(centre_m=(0.0, -0.45, 0.0), radius_m=0.35, height_m=1.0),
    effects=ALL_EFFECTS,
    drag=Drag(law="brown-lawler"),
    wake=Wake(length=300, scaling=400, exponent=0.75),
    local_wake=LocalWake(length=300, scaling=400, exponent=0.75),
    current=Vortex(core_m=0.2, peak_mps=0.5),
)
PLACES = POOL.model_copy(update={"effects": tuple("local_wake" if e == "wake" else e for e in ALL_EFFECTS)})
BED = POOL.model_copy(
    update={
        "id": "bed",
        "density_kg_m3": 1200.0,
        "region": Box(centre_m=(0.0, -0.3, 0.0), size_m=(0.5, 0.5, 0.5)),
        "effects": ("drag", "wake", "buoyancy", "added_mass", "history"),
    }
)
FINITE = POOL.model_copy(update={"effects": ("current", "buoyancy", "surface", "unsteady_drag")})
EVERYTHING = {
    "tail": scene(POOL),
    "places": scene(PLACES),
    "two liquids": scene(POOL, BED),
    "unsteady drag": scene(FINITE),
}


def stroke(ticks: int) -> Any:
    """Return hand positions (n, 3) of a wandering hand that rests now and then."""
    t_s = np.arange(ticks) / 1000
    bent = 0.7 * np.floor(t_s) + np.minimum(t_s % 1, 0.7)
    return 0.04 * np.column_stack([np.sin(4 * bent), 0.3 * np.sin(7 * bent), np.cos(5 * bent)])


def moving(velocity_mps: Any, interval_s: Any = 1e-3) -> Motion:
    """Return the motion (n rows) with these velocities (n, 3) [m/s, scene], Δt before each row [s]."""
    velocity_mps = np.asarray(velocity_mps, float)
    interval_s = np.broadcast_to(interval_s, len(velocity_mps))
    t_s = np.cumsum(interval_s)
    return Motion(t_s, np.cumsum(velocity_mps * interval_s[:, None], axis=0), velocity_mps=velocity_mps)


def columns(table: Any, *names: str) -> Any:
    """Return named columns of a table side by side, (n, k)."""
    return np.column_stack([table[name] for name in names])


def vectors(table: Any, kind: str) -> Any:
    """Return one of a simulated table's vectors, (n, 3): velocity, wake, force or device."""
    names = {
        "velocity": ("vx_mps", "vy_mps", "vz_mps"),
        "wake": ("wake_x_mps", "wake_y_mps", "wake_z_mps"),
        "force": ("fx_n", "fy_n", "fz_n"),
        "device": ("device_fx_n", "device_fy_n", "device_fz_n"),
    }
    return columns(table, *names[kind])


class Hand:
    """Moves a model as a servo would: one call, one tick of 1 ms unless said otherwise."""

    def __init__(
        self, scene: Scene, *, faded_in: bool = True, dynamics: Dynamics = UNKNOWN, rules: ForceRules = CURRENT
    ) -> None:
        self.model = pack(scene, dynamics=dynamics, rules=rules)
        self.safety = new_safety()
        self.safety[0].fade = 1.0 if faded_in else 0.0
        self.sample = records(SAMPLE, 1)
        self.time_ns = 0
        self._tick = entry_of(compute_tick, self.model, self.safety[0], self.sample[0])

    def tick(self, position_m: Any = None, *, after_ns: int = TICK_NS) -> Any:
        """Take one tick, with a new sample at ``position_m`` (hand frame), or without one; return a copy of it."""
        self.time_ns += after_ns
        sample = self.sample[0]
        sample.time_ns = self.time_ns
        sample.fresh = int(position_m is not None)
        if position_m is not None:
            sample.position_m[:] = position_m
        self._tick(self.model, self.safety[0], sample)
        return self.sample.copy()[0]

    def sweep(self, speed_mps: float, ticks: int, *, start_m: float = 0.0) -> list[Any]:
        """Move along x at ``speed_mps`` of the hand from ``start_m`` on; return every sample."""
        return [self.tick((start_m + speed_mps * 1e-3 * k, 0.0, 0.0)) for k in range(1, ticks + 1)]
