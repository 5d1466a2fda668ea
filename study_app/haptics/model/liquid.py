"""What can be felt: regions filled with fluids, the effects they call for, and one frozen model for each effect.

SI units, scene frame (x right, y up, z toward the participant). A parameter that no model names is an error. The
equation of every effect stands in the docstring of its file in ``haptics.kernels.effects``.
"""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias, TypeVar

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator

from study_app.haptics.model.ranges import Decay, DensityKgM3, Exponent, Extent, Flow, Metres, ViscosityPaS, within

Effect: TypeAlias = Literal["drag", "wake", "local_wake", "current", "buoyancy", "surface", "added_mass", "history"]
Effects: TypeAlias = Annotated[
    Annotated[tuple[Effect, ...], Tag("named")] | Annotated[Literal["auto"], Tag("auto")],
    Discriminator(lambda value: "auto" if isinstance(value, str) else "named"),
]

Length: TypeAlias = Annotated[int, within(1, 100_000, "elements, one per millisecond: at most 100 s")]
Scaling: TypeAlias = Annotated[float, within(1, 1e9, "elements; at least the length")]
Smoothing: TypeAlias = Annotated[float, within(0, 1, "a hand moves on within a second")]

MAX_LIQUIDS = 8
MAX_ID = 60
"""Letters of a name that tables and windows can show whole."""


class Frozen(BaseModel):
    """A value: never changed once made, no unknown fields, no infinities."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Everywhere(Frozen):
    """The liquid has no border."""

    kind: Literal["everywhere"] = "everywhere"


class Box(Frozen):
    """A box of full sizes ``size_m`` along x, y, z, around ``centre_m``."""

    kind: Literal["box"] = "box"
    centre_m: Metres = (0.0, 0.0, 0.0)
    size_m: tuple[Extent, Extent, Extent]


class Cylinder(Frozen):
    """An upright cylinder around ``centre_m``."""

    kind: Literal["cylinder"] = "cylinder"
    centre_m: Metres = (0.0, 0.0, 0.0)
    radius_m: Extent
    height_m: Extent


Region: TypeAlias = Annotated[Everywhere | Box | Cylinder, Field(discriminator="kind")]


class Drag(Frozen):
    """Which drag coefficient resists (``effects.drag``): the body's own, or that of a sphere at its Reynolds number."""

    law: Literal["constant", "schiller-naumann", "haider-levenspiel", "brown-lawler"] = "constant"


class Wake(Frozen):
    """The position tail: the liquid velocity left by the body's recent path (Rek 2024, §4.3; ``effects.wake``).

    ``length`` N and ``scaling`` S count elements at 1 kHz; N ≤ S, so that the liquid never outruns the body.
    ``decay`` λ is the factor a millisecond, ``exponent`` y shapes the response to the fill. ``breaking_angle_deg`` β is
    the turn that starts a new segment, taken between elements ``breaking_span_m`` of path apart (0: neighbours).
    ``resolution_m`` is the least motion between two stored elements (0: every tick). ``axes`` says whether vertical
    motion enters the tail.
    """

    length: Length
    scaling: Scaling
    exponent: Exponent = 1.0
    breaking_angle_deg: Annotated[float, within(0, 180, "180° is straight back")] = 45.0
    breaking_span_m: Annotated[float, within(0, 100, "the hand turns within its reach")] = 0.068
    decay: Decay = 0.999975
    resolution_m: Annotated[float, within(0, 10, "a tail of coarser elements never moves")] = 0.0
    axes: Literal["xz", "xyz"] = "xz"

    @model_validator(mode="after")
    def _liquid_never_outruns_the_body(self) -> Wake:
        return _within_scaling(self)


class LocalWake(Frozen):
    """The position tail, tied to the places it was left at (``effects.local_wake``).

    ``length``, ``scaling``, ``exponent``, ``decay`` and ``axes`` as in `Wake`. A place is felt up to about ``reach_m``
    from it (None: one diameter of the body), ever farther and weaker as it spreads by ``spreading_m2ps``.
    """

    length: Length
    scaling: Scaling
    exponent: Exponent = 1.0
    decay: Decay = 0.999975
    axes: Literal["xz", "xyz"] = "xz"
    reach_m: Extent | None = None
    spreading_m2ps: Annotated[float, within(0, 10, "beyond, a wake is gone within a tick")] = 1e-3

    @model_validator(mode="after")
    def _liquid_never_outruns_the_body(self) -> LocalWake:
        return _within_scaling(self)


W = TypeVar("W", Wake, LocalWake)


def _within_scaling(wake: W) -> W:
    if wake.length > wake.scaling:
        raise ValueError(
            f"length {wake.length} exceeds scaling {wake.scaling:g}: the wake would outrun the body; "
            "lower length or raise scaling"
        )
    return wake


class Uniform(Frozen):
    """A current that is the same everywhere in the liquid."""

    kind: Literal["uniform"] = "uniform"
    velocity_mps: tuple[Flow, Flow, Flow]


class Channel(Frozen):
    """A horizontal current between two walls ``width_m`` apart, fastest midway (``peak_mps``), at rest at the walls.

    It flows toward ``heading_deg``: 0 is to the right (+x), 90 away from the participant (−z); its middle line goes
    through ``centre_m``.
    """

    kind: Literal["channel"] = "channel"
    centre_m: Metres = (0.0, 0.0, 0.0)
    heading_deg: Annotated[float, within(-360, 360, "one turn")] = 0.0
    width_m: Extent
    peak_mps: Flow


class Vortex(Frozen):
    """A current around the upright axis through ``centre_m``: ``peak_mps`` at ``core_m`` from it, counter-clockwise."""

    kind: Literal["vortex"] = "vortex"
    centre_m: Metres = (0.0, 0.0, 0.0)
    core_m: Extent
    peak_mps: Flow


Current: TypeAlias = Annotated[Uniform | Channel | Vortex, Field(discriminator="kind")]


class AddedMass(Frozen):
    """The liquid that is accelerated with the body (``effects.added_mass``).

    ``coefficient`` C_a is ½ for a sphere; the acceleration is smoothed over ``filter_s`` (None: as suits the velocity
    estimator, `Scene.smoothing_s`), but not where velocities are given.
    """

    coefficient: Annotated[float, within(0, 10, "a sphere has 0.5")] = 0.5
    filter_s: Smoothing | None = None


class History(Frozen):
    """The Basset force: the boundary layer's memory of past accelerations (``effects.history``).

    Accelerations younger than ``window_s`` count one by one, older ones in ten exponentials. Velocities are smoothed
    over ``smoothing_s`` before (None: as suits the estimator, `Scene.smoothing_s`), but not where they are given.
    """

    window_s: Annotated[float, within(0.005, 0.5, "the window holds 5 to 500 accelerations at 1 kHz")] = 0.05
    smoothing_s: Smoothing | None = None


class Liquid(Frozen):
    """A region filled with a fluid, and the effects it calls for; ``"auto"`` lets ``haptics.model.gate`` choose them.

    The table of an effect that is not called for may stand; it means nothing.
    """

    id: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=MAX_ID)
    density_kg_m3: DensityKgM3
    viscosity_pa_s: ViscosityPaS | None = None
    region: Region = Everywhere()
    effects: Effects = ("drag",)
    drag: Drag = Drag()
    wake: Wake | None = None
    local_wake: LocalWake | None = None
    current: Current | None = None
    added_mass: AddedMass = AddedMass()
    history: History = History()

    @model_validator(mode="after")
    def _effects_have_what_they_need(self) -> Liquid:
        if self.effects == "auto":
            return self
        effects = self.effects
        if len(set(effects)) < len(effects):
            raise ValueError(f"an effect is named twice in {list(effects)}")
        for effect, table, means in (
            ("wake", self.wake, "length, scaling, ..."),
            ("local_wake", self.local_wake, "length, scaling, ..."),
            ("current", self.current, 'kind = "uniform", "channel" or "vortex", ...'),
        ):
            if effect in effects and table is None:
                raise ValueError(f'the effect "{effect}" is called for, but its table ({means}) is missing')
            if effect in effects and "drag" not in effects:
                raise ValueError(f'the effect "{effect}" acts through "drag": name both')
        if "wake" in effects and "local_wake" in effects:
            raise ValueError('"wake" and "local_wake" are two models of the same thing: call for one of them')
        if "drag" in effects and self.drag.law != "constant" and self.viscosity_pa_s is None:
            raise ValueError(f'the drag law "{self.drag.law}" needs the liquid\'s viscosity_pa_s')
        if "history" in effects and self.viscosity_pa_s is None:
            raise ValueError('the effect "history" needs the liquid\'s viscosity_pa_s')
        if "surface" in effects and isinstance(self.region, Everywhere):
            raise ValueError('the effect "surface" needs a region with a top: a box or a cylinder')
        return self
