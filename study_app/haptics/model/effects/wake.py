"""The position tail: the liquid velocity left by the body's recent path."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Protocol, Self, TypeVar

from pydantic import Field, model_validator

from study_app.haptics.model.effect import (
    FLOAT,
    INT,
    TAIL_RATE_HZ,
    Effect,
    Extremes,
    Fields,
    Liquid,
    Parameter,
    Rows,
    Scene,
)
from study_app.haptics.model.ranges import Decay, Exponent, Frozen, TailLength, TailScaling, within

BIT = 1 << 1


class Tail(Protocol):
    """The common parameters of `Wake` and `local_wake.LocalWake`."""

    @property
    def length(self) -> int: ...
    @property
    def scaling(self) -> float: ...
    @property
    def exponent(self) -> float: ...
    @property
    def decay(self) -> float: ...
    @property
    def axes(self) -> Literal["xz", "xyz"]: ...


_W = TypeVar("_W", bound=Tail)


class Wake(Frozen):
    """The position tail: the velocity that the body's recent path leaves in the liquid (Rek 2024, §4.3).

    N ≤ S, so the liquid is never faster than the body.
    """

    length: TailLength
    scaling: TailScaling
    exponent: Exponent = 1.0
    breaking_angle_deg: Annotated[
        float,
        within(0, 180, "180° reverses the direction", what="Change of direction β that starts a new segment [°]."),
    ] = 45.0
    breaking_span_m: Annotated[
        float,
        within(
            0,
            100,
            "a hand changes direction within its reach",
            what="Path length over which directions are compared [m]; 0: neighbouring elements.",
        ),
    ] = 0.068
    decay: Decay = 0.999975
    resolution_m: Annotated[
        float,
        within(
            0,
            10,
            "with a coarser resolution, no element would be stored",
            what="Smallest motion between two stored elements [m]; 0: every tick is stored.",
        ),
    ] = 0.0
    axes: Literal["xz", "xyz"] = Field(
        default="xz", description="xz: the wake ignores vertical motion; xyz: it includes vertical motion."
    )

    @model_validator(mode="after")
    def _liquid_never_outruns_the_body(self) -> Self:
        return within_scaling(self)


def within_scaling(wake: _W) -> _W:
    """Return the wake; raise ValueError if it could move faster than the body (N > S)."""
    if wake.length > wake.scaling:
        raise ValueError(
            f"length {wake.length} exceeds scaling {wake.scaling:g}, so the wake would outrun the body: "
            "reduce length or increase scaling"
        )
    return wake


def scaled_length(wake: Tail, rate_hz: float) -> int:
    """Return N at the scene's rate: rounded down, at least 1."""
    return max(1, math.floor(wake.length * rate_hz / TAIL_RATE_HZ))


def fill_tail(record: Any, wake: Tail, rate_hz: float, row: int) -> None:
    """Write the common parameters of the two wakes."""
    record.row = row
    record.length = scaled_length(wake, rate_hz)
    record.scaling = max(wake.scaling * rate_hz / TAIL_RATE_HZ, record.length)
    record.exponent = wake.exponent
    record.log_decay_per_s = TAIL_RATE_HZ * math.log(wake.decay)
    record.vertical = 1.0 if wake.axes == "xyz" else 0.0


def tail_bound_n(extremes: Extremes, wake: Tail | None) -> float | None:
    """Return F(v + u) − F(v), with u = v (N/S)^y the greatest speed of the wake.

    The laws are convex, so this exceeds the force that a wake removes.
    """
    if wake is None:
        return None
    return float(extremes.drag_by_flow_n(extremes.speed_mps * (wake.length / wake.scaling) ** wake.exponent))


def start_tail(kind: str, centre_m: tuple[float, float, float], reach_m: float) -> Mapping[str, Any]:
    """Return the tail of the thesis' water."""
    return {"length": 1700, "scaling": 1700.0}


def _fill(record: Any, liquid: Liquid, scene: Scene, first: Mapping[str, int]) -> None:
    wake = liquid.wake
    fill_tail(record, wake, scene.rate_hz, first["elements"])
    record.breaking_cosine = math.cos(math.radians(wake.breaking_angle_deg))
    record.breaking_span_m = wake.breaking_span_m
    record.resolution_m = wake.resolution_m


_PARAMETERS: Fields = (
    ("row", INT),  # its first row in the model's elements and segments
    ("length", INT),  # N, in elements at the scene's rate: the rows it owns
    ("scaling", FLOAT),  # S, likewise
    ("exponent", FLOAT),  # y
    ("breaking_cosine", FLOAT),  # cos β
    ("breaking_span_m", FLOAT),
    ("log_decay_per_s", FLOAT),  # ln λ a second
    ("resolution_m", FLOAT),
    ("vertical", FLOAT),  # 1 where vertical motion enters the tail, else 0
)

_STATE: Fields = (
    ("stored", INT),  # elements stored since it was empty: the number of the next one
    ("held", INT),  # how many of them are still in the list
    ("element_lap", INT),  # number of the element in the first row of the ring
    ("segment_lap", INT),  # number of the segment in the first row of its ring
    ("first_segment", INT),  # number of the oldest segment
    ("last_segment", INT),  # number of the newest, to which elements are added
    ("reference", INT),  # number of the element the next one is compared with
    ("scanned", INT),  # number of the first element not yet considered as reference
    ("evicted", INT),  # moving elements removed since the last renewal
    ("arc_m", FLOAT),  # a: path travelled in this liquid
    ("stored_at_m", FLOAT, (3,)),  # where the body was when an element was last stored
    ("scale", FLOAT),  # speeds and sums are stored divided by this common decay
    ("log_decay", FLOAT),  # ln λ over the last interval
    ("decay", FLOAT),  # λ over it
    ("interior_mps", FLOAT, (3,)),  # Σ direction · sum over segments between oldest and newest
    ("interior_carry_mps", FLOAT, (3,)),  # its rounding error
    ("speed_mps", FLOAT),  # Σ|e|
    ("speed_carry_mps", FLOAT),
    ("square_m2ps2", FLOAT),  # Σ|e|²
    ("square_carry_m2ps2", FLOAT),
)

_ELEMENT: Fields = (
    ("velocity_mps", FLOAT, (3,)),  # e, divided by the wake's scale
    ("speed_mps", FLOAT),  # |e|, likewise
    ("arc_m", FLOAT),  # a when it was stored
    ("moving", INT),  # 0 for a zero element
)

_SEGMENT: Fields = (
    ("direction", FLOAT, (3,)),  # unit vector of its newest element
    ("speed_mps", FLOAT),  # Σ|e| of its elements, divided by the wake's scale
    ("speed_carry_mps", FLOAT),  # the rounding error of that sum
    ("count", INT),  # its elements still in the list
)

EFFECT = Effect(
    name="wake",
    label="Wake",
    bit=BIT,
    bound_n=lambda extremes: tail_bound_n(extremes, extremes.liquid.wake),
    automatic=False,
    model=Wake,
    missing="length, scaling, ...",
    through=("drag",),
    parameters=_PARAMETERS,
    state=_STATE,
    fill=_fill,
    rows=(
        Rows(
            "wake elements",
            {"elements": _ELEMENT, "segments": _SEGMENT},
            lambda liquid, rate_hz: scaled_length(liquid.wake, rate_hz),
        ),
    ),
    start=start_tail,
    thresholds=("breaking_angle_deg", "breaking_span_m", "resolution_m"),
    controls=(
        Parameter("wake.length", "Length", unit="ticks", logarithmic=True, whole=True, decimals=0),
        Parameter("wake.scaling", "Scaling", unit="ticks", least=1.0, most=1e5, logarithmic=True, decimals=0),
        Parameter("wake.exponent", "Exponent", unit="", least=0.05, logarithmic=True),
        Parameter("wake.breaking_angle_deg", "Breaking angle", unit="°", decimals=1),
        Parameter("wake.breaking_span_m", "Breaking span", unit="m", most=0.5, factor=1e3, shown_unit="mm", decimals=1),
        Parameter("wake.decay", "Decay", unit="per tick", least=0.99, decimals=6),
        Parameter("wake.resolution_m", "Resolution", unit="m", most=0.05, factor=1e3, shown_unit="mm", decimals=1),
        Parameter("wake.axes", "Axes", choices=(("xz", "Horizontal (thesis)"), ("xyz", "All three"))),
    ),
)
