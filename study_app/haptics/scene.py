"""What is presented together: a body, the liquids around it, and how its motion is measured.

Frozen, validated values in SI units and the scene frame (x right, y up, z toward the participant; scene = scale · hand
+ origin). A parameter that no model names is an error. Meaning of every number: the docstrings here; of every formula:
``haptics.effects``.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from study_app.errors import StudyError

Metres: TypeAlias = tuple[float, float, float]
Positive: TypeAlias = Annotated[float, Field(gt=0)]
Effect: TypeAlias = Literal["drag", "wake"]

MAX_LIQUIDS = 8


class Frozen(BaseModel):
    """A value: never changed once made, no unknown fields, no infinities."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Body(Frozen):
    """The ball that is moved through the liquids."""

    diameter_m: float = Field(default=0.068, ge=1e-3, le=1)
    drag_coefficient: float = Field(default=0.47, ge=0, le=10)
    density_kg_m3: float = Field(default=1000.0, gt=0, le=25_000)


class Everywhere(Frozen):
    """The liquid has no border."""

    kind: Literal["everywhere"] = "everywhere"


class Box(Frozen):
    """A box of full sizes ``size_m`` along x, y, z, around ``centre_m``."""

    kind: Literal["box"] = "box"
    centre_m: Metres = (0.0, 0.0, 0.0)
    size_m: tuple[Positive, Positive, Positive]


class Cylinder(Frozen):
    """An upright cylinder around ``centre_m``."""

    kind: Literal["cylinder"] = "cylinder"
    centre_m: Metres = (0.0, 0.0, 0.0)
    radius_m: Positive
    height_m: Positive


Region: TypeAlias = Annotated[Everywhere | Box | Cylinder, Field(discriminator="kind")]


class Wake(Frozen):
    """The position tail: the liquid velocity left by the body's recent path (Rek 2024, §4.3; ``effects.wake``).

    ``length`` N and ``scaling`` S count elements at 1 kHz; N ≤ S, so that the liquid never outruns the body.
    ``decay`` λ is the factor a millisecond, ``exponent`` y shapes the response to the fill. ``breaking_angle_deg`` β is
    the turn that starts a new segment, taken between elements ``breaking_span_m`` of path apart (0: neighbours).
    ``resolution_m`` is the least motion between two stored elements (0: every tick). ``axes`` says whether vertical
    motion enters the tail.
    """

    length: int = Field(ge=1, le=100_000)
    scaling: float = Field(gt=0, le=1e9)
    exponent: float = Field(default=1.0, gt=0, le=10)
    breaking_angle_deg: float = Field(default=45.0, ge=0, le=180)
    breaking_span_m: float = Field(default=0.068, ge=0)
    decay: float = Field(default=0.999975, gt=0, le=1)
    resolution_m: float = Field(default=0.0, ge=0)
    axes: Literal["xz", "xyz"] = "xz"

    @model_validator(mode="after")
    def _liquid_never_outruns_the_body(self) -> Wake:
        if self.length > self.scaling:
            raise ValueError(
                f"length {self.length} exceeds scaling {self.scaling:g}: the wake would outrun the body; "
                "lower length or raise scaling"
            )
        return self


class Liquid(Frozen):
    """A region filled with a fluid, and the effects it calls for."""

    id: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")
    density_kg_m3: float = Field(gt=0, le=25_000)
    viscosity_pa_s: float | None = Field(default=None, gt=0)
    region: Region = Everywhere()
    effects: tuple[Effect, ...] = ("drag",)
    wake: Wake | None = None

    @model_validator(mode="after")
    def _effects_have_what_they_need(self) -> Liquid:
        if len(set(self.effects)) < len(self.effects):
            raise ValueError(f"an effect is named twice in {list(self.effects)}")
        if "wake" in self.effects and self.wake is None:
            raise ValueError('the effect "wake" is called for, but its table (length, scaling, ...) is missing')
        if "wake" in self.effects and "drag" not in self.effects:
            raise ValueError('the effect "wake" acts through "drag": name both')
        return self


class Ewma(Frozen):
    """Exponentially weighted velocity; ``alpha`` is the weight of the newest difference at 1 kHz."""

    kind: Literal["ewma"] = "ewma"
    alpha: float = Field(default=0.1, gt=0, le=1)


class Given(Frozen):
    """The velocity comes with the motion: for recorded or programmed motions, never for a device."""

    kind: Literal["given"] = "given"


Velocity: TypeAlias = Annotated[Ewma | Given, Field(discriminator="kind")]


class Knee(Frozen):
    """How speeds above a threshold are lowered before anything is computed from them."""

    law: Literal["sqrt", "square", "none"] = "sqrt"
    threshold_mps: float = Field(default=5.0, gt=0)


class Scene(Frozen):
    """Everything the force model needs. Without liquids a scene is rest: zero force.

    ``scale`` and ``origin_m`` map the hand into the scene; ``rate_hz`` is the nominal rate of ticks; ``force_limit_n``
    the greatest force that may be sent.
    """

    scale: float = Field(default=10.0, ge=0.01, le=100)
    origin_m: Metres = (0.0, 0.0, 0.0)
    rate_hz: float = Field(default=1000.0, ge=50, le=5000)
    body: Body = Body()
    liquids: tuple[Liquid, ...] = Field(default=(), max_length=MAX_LIQUIDS)
    velocity: Velocity = Ewma()
    knee: Knee = Knee()
    force_limit_n: float = Field(default=8.0, gt=0, le=20)

    @model_validator(mode="after")
    def _liquids_are_told_apart(self) -> Scene:
        names = [liquid.id for liquid in self.liquids]
        if len(set(names)) < len(names):
            raise ValueError(f"two liquids share an id in {names}")
        return self


def override(scene: Scene, name: str, value: object) -> Scene:
    """Return ``scene`` with the one parameter called ``name`` set to ``value``; see `override_all`."""
    return override_all(scene, {name: value})


def override_all(scene: Scene, values: Mapping[str, object]) -> Scene:
    """Return ``scene`` with parameters set by name, validated once all are set.

    A name is that of a field of the liquid, its wake, the body, the velocity estimator, the knee or the scene itself,
    in this order where two share one (``density_kg_m3`` is the liquid's, ``body.density_kg_m3`` the body's). With
    several liquids all that have the parameter get it. Text is read as the field's type; tuples are split at commas.

    Raises
    ------
    StudyError
        An unknown name, or a value out of range.
    """
    tree = scene.model_dump()
    tables = dict(_tables(tree))
    for name, value in values.items():
        for table, field in _places(tables, name):
            split = isinstance(value, str) and isinstance(table[field], tuple)
            table[field] = tuple(value.split(",")) if split and isinstance(value, str) else value
    try:
        return Scene.model_validate(tree)
    except ValidationError as error:
        named = ", ".join(f"{name} = {value}" for name, value in values.items())
        reasons = "; ".join(
            f"{'.'.join(str(part) for part in problem['loc'])}: {problem['msg']}" for problem in error.errors()
        )
        raise StudyError(f"cannot set {named}: {reasons}") from error


def _tables(tree: dict[str, Any]) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """Yield the places a parameter may sit in, those first that a plain name means first."""
    liquids = list(tree["liquids"])
    yield "liquid", liquids
    yield "wake", [liquid["wake"] for liquid in liquids if liquid["wake"] is not None]
    yield "body", [tree["body"]]
    yield "velocity", [tree["velocity"]]
    yield "knee", [tree["knee"]]
    yield "scene", [tree]


_NOT_A_PARAMETER = {"id", "kind", "region", "wake", "body", "liquids", "velocity", "knee"}


def _places(tables: dict[str, list[dict[str, Any]]], name: str) -> list[tuple[dict[str, Any], str]]:
    """Return the (table, field) pairs that ``name`` means."""
    place, _, field = name.rpartition(".")
    for table_name, rows in tables.items():
        found = [(row, field) for row in rows if field in row and field not in _NOT_A_PARAMETER]
        if found and place in {"", table_name}:
            return found
    known = sorted({key for rows in tables.values() for row in rows for key in row} - _NOT_A_PARAMETER)
    near = difflib.get_close_matches(field, known, n=1)
    meant = f"did you mean {near[0]!r}? " if near else ""
    raise StudyError(f"this scene has no parameter {name!r}: {meant}it has {', '.join(known)}")
