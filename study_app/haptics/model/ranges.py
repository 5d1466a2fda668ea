"""Ranges of the numbers in files, each with its reason, which error messages state."""

from typing import Annotated, Any, Final, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

REASON: Final = "reason"
OF_MOST: Final = "reason_of_most"
"""JSON Schema key of the reason for a number's range."""


class Frozen(BaseModel):
    """An immutable value without unknown fields or infinities."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)


def later(default: Any = None, **about: Any) -> Any:
    """Return a field whose default is not written, so that files and hashes from before it keep their bytes."""
    usual = {} if "default_factory" in about else {"default": default}
    return Field(**usual, **about, exclude_if=lambda value: value == usual.get("default", {}))


def within(
    least: float, most: float, why: str, usual: float | None = None, what: str | None = None, *, of_most: bool = False
) -> Any:
    """Return the annotation of a number from ``least`` to ``most``, both included.

    ``why`` is the reason for both ends, or with ``of_most`` for the upper one. An editor starts with ``usual``;
    ``what`` describes the number.
    """
    examples = None if usual is None else [usual]
    reason: dict[str, Any] = {OF_MOST if of_most else REASON: why}
    return Field(ge=least, le=most, description=what, examples=examples, json_schema_extra=reason)


Coordinate: TypeAlias = Annotated[float, within(-1000, 1000, "a scene is at most 1 km wide")]
Extent: TypeAlias = Annotated[
    float, within(1e-3, 1000, "a hand cannot resolve smaller lengths, and a scene is at most 1 km wide")
]
Metres: TypeAlias = tuple[Coordinate, Coordinate, Coordinate]
Vector: TypeAlias = tuple[float, float, float]
"""x, y and z."""
Flow: TypeAlias = Annotated[float, within(-100, 100, "liquids around a hand flow at less than 100 m/s")]
DensityKgM3: TypeAlias = Annotated[
    float,
    within(
        0.01,
        25_000,
        "the density of hydrogen is 0.08 kg/m³, that of osmium, the densest element, 22 590 kg/m³",
        1200,
        "Density [kg/m³].",
    ),
]
ViscosityPaS: TypeAlias = Annotated[
    float, within(1e-6, 1e6, "gases have 1e-5 Pa·s, honey 10, tar 100", what="Dynamic viscosity [Pa·s].")
]
DiameterM: TypeAlias = Annotated[
    float, within(1e-3, 1, "the ball is moved by hand", 0.068, "Diameter of the ball [m].")
]
DragCoefficient: TypeAlias = Annotated[
    float,
    within(0, 10, "a wing has 0.04, a sphere 0.47, a plate 1.2", 0.47, "Drag coefficient in the constant drag law."),
]
Alpha: TypeAlias = Annotated[
    float,
    within(
        0.001,
        1,
        "at 0.001 the velocity lags 1 s behind the hand; at 1 it is not smoothed",
        what="Weight of the newest position difference at 1 kHz.",
    ),
]
ForceLimitN: TypeAlias = Annotated[float, within(0.1, 20, "a hand feels little below 0.1 N and may be hurt above 20 N")]
FadeS: TypeAlias = Annotated[
    float, within(0.05, 2, ("a faster onset feels like a knock; a slower one does not feel like an onset"))
]
Decay: TypeAlias = Annotated[
    float,
    within(
        0.5,
        1,
        "the proportion that remains after 1 ms; with 0.5, the wake is gone after 10 ms",
        what="Factor λ by which a stored velocity decays in 1 ms.",
    ),
]
Exponent: TypeAlias = Annotated[
    float,
    within(
        0.05, 10, ("outside this range, a wake develops at once or not at all"), what="Response exponent y of the wake."
    ),
]
Smoothing: TypeAlias = Annotated[float, within(0, 1, "a hand's motion changes within a second")]
TailLength: TypeAlias = Annotated[
    int,
    within(
        1,
        100_000,
        "one element is stored per millisecond, so this is at most 100 s",
        what="Number N of velocities that the wake stores, one per millisecond.",
    ),
]
TailScaling: TypeAlias = Annotated[
    float,
    within(
        1,
        1e9,
        "the divisor is at least the number of stored velocities",
        what=("Divisor S for the sum of the stored velocities, at least N."),
    ),
]
