"""Current: a liquid that flows by itself."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal, TypeAlias

from pydantic import Field

from study_app.haptics.model import ranges
from study_app.haptics.model.effect import FLOAT, INT, Effect, Extremes, Fields, Flow, Liquid, Parameter, Scene
from study_app.haptics.model.ranges import Extent, Frozen, Metres, within

BIT = 1 << 3

CURRENT_UNIFORM = 0
CURRENT_CHANNEL = 1
_CURRENT_VORTEX = 2

_START_MPS: Final = 0.5


class Uniform(Frozen):
    """A current that is the same everywhere in the liquid."""

    kind: Literal["uniform"] = "uniform"
    velocity_mps: tuple[ranges.Flow, ranges.Flow, ranges.Flow] = Field(
        description="Velocity of the current along x, y, z [m/s]."
    )


class Channel(Frozen):
    """A horizontal current between two parallel walls, fastest midway between them and zero at the walls."""

    kind: Literal["channel"] = "channel"
    centre_m: Metres = Field(default=(0.0, 0.0, 0.0), description="A point on the centre line [m].")
    heading_deg: Annotated[
        float,
        within(
            -360, 360, "one full turn", what="Direction [°]: 0 is to the right (+x), 90 away from the participant (−z)."
        ),
    ] = 0.0
    width_m: Extent = Field(description="Distance between the walls [m].")
    peak_mps: ranges.Flow = Field(description="Speed midway between the walls [m/s].")


class Vortex(Frozen):
    """A current around an upright axis, counter-clockwise as seen from above."""

    kind: Literal["vortex"] = "vortex"
    centre_m: Metres = Field(default=(0.0, 0.0, 0.0), description="A point on the axis [m].")
    core_m: Extent = Field(description="Distance from the axis at which the current is fastest [m].")
    peak_mps: ranges.Flow = Field(description="Speed at that distance [m/s].")


Current: TypeAlias = Annotated[
    Uniform | Channel | Vortex, Field(discriminator="kind", description="The liquid's own flow.")
]


def flow(current: Current) -> Flow:
    """Return the greatest speed of a current and its greatest shear."""
    if isinstance(current, Uniform):
        return Flow(math.hypot(*current.velocity_mps), 0.0)
    if isinstance(current, Channel):
        return Flow(abs(current.peak_mps), 4 * abs(current.peak_mps) / current.width_m)
    if isinstance(current, Vortex):
        return Flow(abs(current.peak_mps), 2 * abs(current.peak_mps) / current.core_m)
    raise TypeError(f"no bound is known for a current of kind {current!r}")


def _bound_n(extremes: Extremes) -> float | None:
    """Return F(v + u) − F(v) at its greatest speed u, plus the inertial force in its shear s.

    The liquid's velocity at the moving ball changes by up to u, at a rate of up to s v.
    """
    if extremes.liquid.current is None:
        return None
    return float(extremes.drag_by_flow_n(extremes.flow.speed_mps) + extremes.sheared_n())


def _start(kind: str, centre_m: tuple[float, float, float], reach_m: float) -> Mapping[str, Any]:
    begun: dict[str, dict[str, Any]] = {
        "uniform": {"velocity_mps": (_START_MPS, 0.0, 0.0)},
        "channel": {"centre_m": centre_m, "width_m": 2 * reach_m, "peak_mps": _START_MPS},
        "vortex": {"centre_m": centre_m, "core_m": reach_m / 2, "peak_mps": _START_MPS},
    }
    kind = kind or "uniform"
    return {"kind": kind, **begun[kind]}


def _fill(record: Any, liquid: Liquid, scene: Scene, first: Mapping[str, int]) -> None:
    current: Current = liquid.current
    if isinstance(current, Uniform):
        record.kind = CURRENT_UNIFORM
        record.velocity_mps[:] = current.velocity_mps
        return
    record.centre_m[:] = current.centre_m
    if isinstance(current, Channel):
        record.kind = CURRENT_CHANNEL
        heading = math.radians(current.heading_deg)
        record.velocity_mps[:] = current.peak_mps * math.cos(heading), 0.0, -current.peak_mps * math.sin(heading)
        record.across[:] = math.sin(heading), 0.0, math.cos(heading)
        record.size_m = current.width_m / 2
    else:
        record.kind = _CURRENT_VORTEX
        record.size_m = current.core_m
        record.peak_mps = current.peak_mps


_PARAMETERS: Fields = (
    ("kind", INT),  # CURRENT_*
    ("centre_m", FLOAT, (3,)),
    ("velocity_mps", FLOAT, (3,)),  # uniform: everywhere; channel: midway
    ("across", FLOAT, (3,)),  # channel: unit vector from wall to wall
    ("size_m", FLOAT),  # channel: half the width; vortex: the core's radius
    ("peak_mps", FLOAT),  # vortex: at that radius
)

_STATE: Fields = (("velocity_mps", FLOAT, (3,)),)

EFFECT = Effect(
    name="current",
    label="Current",
    bit=BIT,
    bound_n=_bound_n,
    extent="area",
    flow=flow,
    model=Current,
    missing='kind = "uniform", "channel" or "vortex", ...',
    through=("drag", "unsteady_drag", "non_newtonian"),
    parameters=_PARAMETERS,
    state=_STATE,
    fill=_fill,
    start=_start,
    controls=(
        Parameter(
            "current.kind", "Current", choices=(("uniform", "Uniform"), ("channel", "Channel"), ("vortex", "Vortex"))
        ),
        Parameter("current.velocity_mps", "Speed", unit="m/s", least=-5.0, most=5.0),
        Parameter(
            "current.centre_m", "Centre", unit="m", least=-1.0, most=1.0, factor=1e3, shown_unit="mm", decimals=0
        ),
        Parameter("current.heading_deg", "Heading", unit="°", decimals=0),
        Parameter(
            "current.width_m",
            "Width",
            unit="m",
            least=0.01,
            most=5.0,
            logarithmic=True,
            factor=1e3,
            shown_unit="mm",
            decimals=0,
        ),
        Parameter("current.peak_mps", "Peak speed", unit="m/s", least=-5.0, most=5.0),
        Parameter(
            "current.core_m",
            "Core",
            unit="m",
            least=0.01,
            most=2.0,
            logarithmic=True,
            factor=1e3,
            shown_unit="mm",
            decimals=0,
        ),
    ),
)
