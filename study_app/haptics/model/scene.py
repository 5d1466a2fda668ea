"""What is presented together: a body, the liquids around it, and how its motion is measured.

Frozen, validated values in SI units and the scene frame (x right, y up, z toward the participant; scene = scale · hand
+ origin). A parameter that no model names is an error. An effect's table is the model in its descriptor
(``haptics.model.effects``); its equation stands in the docstring of its file in ``haptics.kernels.effects``.
"""

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Final, Literal, Self, TypeAlias

from pydantic import Discriminator, Field, Tag, create_model, model_validator
from pydantic.json_schema import SkipJsonSchema

from study_app.haptics.model.effect import Effect as EffectDescriptor
from study_app.haptics.model.effects import EFFECTS, NAMED
from study_app.haptics.model.estimators import Ewma, Given, Kalman, Raw, Withdrawn
from study_app.haptics.model.ranges import (
    Coordinate,
    DensityKgM3,
    DiameterM,
    DragCoefficient,
    Extent,
    FadeS,
    ForceLimitN,
    Frozen,
    Metres,
    ViscosityPaS,
    later,
    within,
)
from study_app.ids import MAX_ID

if TYPE_CHECKING:
    Effect: TypeAlias = str
    Effects: TypeAlias = tuple[str, ...] | Literal["auto"]
else:
    Effect = Literal[tuple(NAMED)]
    Effects = Annotated[
        Annotated[tuple[Effect, ...], Tag("named")] | Annotated[Literal["auto"], Tag("auto")],
        Discriminator(lambda value: "auto" if isinstance(value, str) else "named"),
    ]

MAX_LIQUIDS = 8


class Everywhere(Frozen):
    """The liquid fills the whole scene."""

    kind: Literal["everywhere"] = "everywhere"


class Box(Frozen):
    """A box along the axes."""

    kind: Literal["box"] = "box"
    centre_m: Metres = Field(default=(0.0, 0.0, 0.0), description="Centre of the box [m].")
    size_m: tuple[Extent, Extent, Extent] = Field(description="Full size along x, y and z [m].")


class Cylinder(Frozen):
    """An upright cylinder."""

    kind: Literal["cylinder"] = "cylinder"
    centre_m: Metres = Field(default=(0.0, 0.0, 0.0), description="Centre of the cylinder [m].")
    radius_m: Extent = Field(description="Radius [m].")
    height_m: Extent = Field(description="Height [m].")


Region: TypeAlias = Annotated[
    Everywhere | Box | Cylinder, Field(discriminator="kind", description="Location of the liquid in the scene.")
]


class _Liquid(Frozen):
    """The fields of a liquid that do not belong to an effect."""

    id: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=MAX_ID)
    density_kg_m3: DensityKgM3
    viscosity_pa_s: ViscosityPaS | None = None
    region: Region = Everywhere()
    effects: Effects = Field(
        default=("drag",), description='The liquid\'s effects; "auto" selects them by their size (scene.accuracy).'
    )

    @model_validator(mode="after")
    def _effects_have_what_they_need(self) -> Self:
        if self.effects == "auto":
            self._check_effects(it for it in EFFECTS if it.default is None and getattr(self, it.name, None) is not None)
            return self
        if len(set(self.effects)) < len(self.effects):
            raise ValueError(f"an effect is listed twice in {list(self.effects)}")
        called_for = [effect for effect in EFFECTS if effect.name in self.effects]
        for effect in called_for:
            if effect.model is not None and getattr(self, effect.name) is None:
                raise ValueError(f'the effect "{effect.name}" is selected, but its table ({effect.missing}) is missing')
            if effect.through and not set(effect.through) & set(self.effects):
                carriers = " or ".join(f'"{name}"' for name in effect.through)
                raise ValueError(f'the effect "{effect.name}" acts through {carriers}: list both')
        for effect in called_for:
            for other in effect.excludes:
                if other in self.effects:
                    raise ValueError(
                        f'"{other}" and "{effect.name}" are two models of the same effect: select one of them'
                    )
        self._check_effects(called_for)
        return self

    def _check_effects(self, effects: Iterable[EffectDescriptor]) -> None:
        for effect in effects:
            problem = effect.problem(self) if effect.problem is not None else None
            if problem is not None:
                raise ValueError(problem)


_DOC = """A region with a fluid, and its effects; ``"auto"`` lets ``haptics.model.gate`` choose them.

       Tables of effects that are not selected are permitted, but they are ignored.
       """

if TYPE_CHECKING:

    class Liquid(_Liquid):
        """A region filled with a fluid; every effect with a table has it as an attribute of the effect's name."""

        def __init__(self, **fields: Any) -> None: ...
        def __getattr__(self, name: str) -> Any: ...

else:
    Liquid = create_model(
        "Liquid",
        __base__=_Liquid,
        __module__=__name__,
        __doc__=_DOC,
        **{
            effect.name: (
                effect.model if effect.default is not None else effect.model | None,
                later() if effect.default is None else effect.default,
            )
            for effect in EFFECTS
            if effect.model is not None
        },
    )


STORED_FORCES: Final = 1024
"""Number of stored forces: delay and jitter together are shorter [ticks]."""
__all__ = [
    "MAX_LIQUIDS",
    "Accuracy",
    "Body",
    "Box",
    "Cylinder",
    "Effect",
    "Estimator",
    "Everywhere",
    "Ewma",
    "Frozen",
    "Given",
    "Kalman",
    "Knee",
    "Liquid",
    "MotionBox",
    "Raw",
    "Region",
    "Scene",
    "Velocity",
    "Withdrawn",
]
RateHz: TypeAlias = Annotated[
    float, within(50, 5000, ("a slower servo is never stable; a faster servo cannot finish its ticks in time"))
]
SceneScale: TypeAlias = Annotated[
    float, within(0.01, 100, "within these limits, a 60 mm stroke covers 0.6 mm to 6 m in the scene")
]
FADE_S = 0.05
_HAND_SPEED_MPS = 0.3
_HAND_ACCELERATION_MPS2 = 3.0  # 0.3 m/s at 1.6 Hz
_HAND_REACH_M = 0.04
Estimator: TypeAlias = Annotated[Ewma | Kalman | Raw | SkipJsonSchema[Withdrawn], Field(discriminator="kind")]
Velocity: TypeAlias = Annotated[Ewma | Kalman | Raw | SkipJsonSchema[Withdrawn] | Given, Field(discriminator="kind")]


class ForceLink(Frozen):
    """A link that sends the force of the effects late, with jitter and loss.

    Parameters
    ----------
    delay_s : float
        Delay of every force [s].
    jitter_s : float
        A force is later by up to this, drawn again at every tick from a uniform distribution [s].
    loss : float
        Fraction of ticks whose force is lost: the last one is held.
    seed : int
        Of jitter and loss, below 2³².
    """

    MOST_DELAY_MS: ClassVar[int] = 200
    MOST_JITTER_MS: ClassVar[int] = 50
    MOST_LOSS: ClassVar[float] = 0.5

    delay_s: Annotated[
        float,
        within(0, MOST_DELAY_MS / 1000, "with a longer delay, a liquid pushes instead of resisting", of_most=True),
    ] = 0.0
    jitter_s: Annotated[float, within(0, MOST_JITTER_MS / 1000, "jitter in networks is smaller", of_most=True)] = 0.0
    loss: Annotated[
        float, within(0, MOST_LOSS, "with higher losses, most forces would repeat the previous one", of_most=True)
    ] = 0.0
    seed: Annotated[int, within(0, 2**32 - 1, "32 bits")] = 0

    @property
    def acts(self) -> bool:
        return self.delay_s > 0 or self.jitter_s > 0 or self.loss > 0

    def ticks(self, rate_hz: float) -> tuple[int, int]:
        return round(self.delay_s * rate_hz), round(self.jitter_s * rate_hz)

    def mean_delay_s(self, rate_hz: float) -> float:
        """Return the approximate mean delay of a force [s].

        A force older than the last one is skipped, so a uniform jitter of J ticks adds about √(πJ/2) ticks.
        """
        return self.delay_s + math.sqrt(math.pi / 2 * self.ticks(rate_hz)[1]) / rate_hz

    def refusal_reason(self, rate_hz: float) -> str | None:
        """Return the reason why too few forces are stored for the delay, in a sentence, or None."""
        if sum(self.ticks(rate_hz)) < STORED_FORCES:
            return None
        most_ms = 1000 * STORED_FORCES / rate_hz
        return f"the sum of the force's delay and jitter must be below {most_ms:g} ms at {rate_hz:g} Hz"


PROMPT_LINK: Final = ForceLink()
"""No link, the default: the force of a tick is sent in that tick."""


class Body(Frozen):
    """The ball that is moved through the liquids."""

    diameter_m: DiameterM = 0.068
    drag_coefficient: DragCoefficient = 0.47
    density_kg_m3: DensityKgM3 = 1000.0

    @property
    def volume_m3(self) -> float:
        return math.pi / 6 * self.diameter_m**3


class Knee(Frozen):
    """The reduction of speeds above a threshold, applied before all other computations."""

    law: Literal["sqrt", "square", "none"] = Field(
        default="sqrt",
        description="sqrt: speeds above the threshold grow as √(1 + 2 excess) − 1; square: they grow as the square of "
        "the excess; none: speeds are not reduced.",
    )
    threshold_mps: Annotated[
        float,
        within(
            0.01,
            1000,
            "a hand moves at 0.01 to 2 m/s, multiplied by the scale",
            what="Speed in the scene above which speeds are reduced [m/s].",
        ),
    ] = 5.0


class Accuracy(Frozen):
    """The force that ``effects = "auto"`` may omit: a fraction of the total or an absolute force (the greater)."""

    relative: Annotated[
        float,
        within(
            0,
            1,
            "a proportion of the force",
            what="Largest proportion of the force, or of the force limit, that may be omitted.",
        ),
    ] = 0.05
    absolute_n: Annotated[
        float,
        within(
            0,
            20,
            "the force limit is at most 20 N",
            what="Largest force that may be omitted, if greater than that proportion [N].",
        ),
    ] = 0.05
    without: tuple[Effect, ...] = later(default=(), description='Effects that "auto" never selects.')


class MotionBox(Frozen):
    """The expected range of the ball's motion in the scene.

    The defaults assume a hand that moves 40 mm in every direction at up to 0.3 m/s and 3 m/s².
    """

    speed_mps: (
        Annotated[float, within(0.001, 1000, "a hand moves at 0.01 to 2 m/s, multiplied by the scale")] | None
    ) = Field(default=None, description="Maximum speed [m/s].")
    acceleration_mps2: (
        Annotated[float, within(0.001, 1e5, "a hand accelerates at 0.01 to 100 m/s², multiplied by the scale")] | None
    ) = Field(default=None, description="Maximum acceleration [m/s²].")
    depth_m: tuple[Coordinate, Coordinate] | None = Field(
        default=None,
        description="Minimum and maximum depth of the ball's centre below a liquid's top face [m]; negative if "
        "above it.",
    )

    @model_validator(mode="after")
    def _least_depth_comes_first(self) -> Self:
        if self.depth_m is not None and self.depth_m[0] > self.depth_m[1]:
            raise ValueError(
                f"depth_m must be the minimum depth followed by the maximum depth, not {list(self.depth_m)}"
            )
        return self


class Scene(Frozen):
    """All inputs of the force model. A scene without liquids has zero force.

    ``scale`` and ``origin_m`` map the hand into the scene; ``rate_hz`` is the nominal tick rate; ``force_limit_n`` the
    greatest permitted force; ``fade_s`` the fade-in time; ``link`` the delay of the force, which scene files cannot
    set. ``accuracy`` and ``motion`` are for liquids with ``effects = "auto"``.
    """

    scale: SceneScale = 10.0
    origin_m: Metres = (0.0, 0.0, 0.0)
    rate_hz: RateHz = 1000.0
    body: Body = Body()
    liquids: tuple[Liquid, ...] = Field(default=(), max_length=MAX_LIQUIDS)
    velocity: Velocity = Ewma()
    knee: Knee = Knee()
    force_limit_n: ForceLimitN = 8.0
    fade_s: FadeS = FADE_S
    accuracy: Accuracy = Accuracy()
    motion: MotionBox = MotionBox()
    link: ForceLink = PROMPT_LINK

    @model_validator(mode="after")
    def _liquids_are_told_apart(self) -> Self:
        names = [liquid.id for liquid in self.liquids]
        if len(set(names)) < len(names):
            raise ValueError(f"two liquids share an ID in {names}")
        return self

    @model_validator(mode="after")
    def _link_reaches_back(self) -> Self:
        if reason := self.link.refusal_reason(self.rate_hz):
            raise ValueError(reason)
        return self

    def motion_in(self, liquid: Liquid) -> MotionBox:
        """Return ``motion`` with its open values filled in; without a top face there is no depth."""
        depth_m = self.motion.depth_m
        if depth_m is None and not isinstance(liquid.region, Everywhere):
            region = liquid.region
            top_m = region.centre_m[1] + (region.size_m[1] if isinstance(region, Box) else region.height_m) / 2
            middle_m, reach_m = top_m - self.origin_m[1], self.scale * _HAND_REACH_M
            depth_m = (middle_m - reach_m, middle_m + reach_m)
        return MotionBox(
            speed_mps=self.motion.speed_mps or self.scale * _HAND_SPEED_MPS,
            acceleration_mps2=self.motion.acceleration_mps2 or self.scale * _HAND_ACCELERATION_MPS2,
            depth_m=depth_m,
        )
