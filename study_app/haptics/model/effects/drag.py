"""Drag: the liquid resists motion relative to it."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Final, Self, TypeAlias

from pydantic import Field, model_validator

from study_app.haptics.model.effect import FLOAT, INT, Effect, Extremes, Fields, Liquid, Parameter, Scene
from study_app.haptics.model.laws import LAW_NAMES, LAWS, Law, drag_n
from study_app.haptics.model.ranges import Frozen, later, within

BIT = 1 << 0

LAW_CONSTANT = 0
_LAW_SCHILLER_NAUMANN = 1
LAW_HAIDER_LEVENSPIEL = 2
LAW_BROWN_LAWLER = 3
LAW_LINEAR = 4
_LAWS: Final[dict[Law, int]] = {
    "constant": LAW_CONSTANT,
    "schiller-naumann": _LAW_SCHILLER_NAUMANN,
    "haider-levenspiel": LAW_HAIDER_LEVENSPIEL,
    "brown-lawler": LAW_BROWN_LAWLER,
    "linear": LAW_LINEAR,
}

REFERENCE: Final[Law] = "haider-levenspiel"
"""The reference law of drag: its published constants are confirmed, and it is closest to experiments."""
_SPEEDS: Final = 60
DAMPING_NSPM: Final = (0.01, 200.0)
_DAMPING_NSPM: Final = 8.0
"""Initial damping in the lab: more than honey in slow motion, far below any slope limit. [choice]"""

_DampingNspm: TypeAlias = Annotated[
    float,
    within(
        *DAMPING_NSPM,
        "people cannot feel damping below 0.01 N·s/m, and no loop is stable above 200",
        what="Damping b in the linear law [N·s/m].",
    ),
]


class Drag(Frozen):
    """The drag law: a constant coefficient, or the coefficient of a sphere at its Reynolds number.

    The law "linear" is a damper, F = −b v, where b is ``damping_nspm`` [N·s/m] and v is the velocity of the hand; the
    scale, the ball and the knee have no effect.
    """

    law: Law = Field(
        default="constant",
        description="constant: a constant drag coefficient; schiller-naumann: Schiller & Naumann 1933; "
        "haider-levenspiel: Haider & Levenspiel 1989; brown-lawler: Brown & Lawler 2003; linear: a damper.",
    )
    damping_nspm: _DampingNspm | None = later()

    @model_validator(mode="after")
    def _damping_of_the_linear_law(self) -> Self:
        if (self.law == "linear") != (self.damping_nspm is not None):
            needs = "is used only by" if self.damping_nspm is not None else "is missing: it is required by"
            raise ValueError(f'damping_nspm {needs} the drag law "linear"')
        return self


def resistance_n(scene: Scene, liquid: Liquid, relative_mps: float, law: Law | None = None) -> float:
    """Return the drag [N] on the scene's body at a relative speed; by default from the most accurate law.

    A damper always uses its own law.
    """
    if liquid.drag.damping_nspm is not None:
        return float(liquid.drag.damping_nspm / scene.scale * relative_mps)
    return drag_n(
        law or ("constant" if liquid.viscosity_pa_s is None else REFERENCE),
        relative_mps,
        density_kg_m3=liquid.density_kg_m3,
        viscosity_pa_s=liquid.viscosity_pa_s,
        diameter_m=scene.body.diameter_m,
        drag_coefficient=scene.body.drag_coefficient,
    )


def cheapest_law(extremes: Extremes) -> Law:
    """Return the cheapest law of drag within the accuracy target of the reference law, at every speed of the motion."""
    if extremes.liquid.viscosity_pa_s is None:
        return "constant"
    candidates: tuple[Law, ...] = ("constant", *LAWS)
    return next((law for law in candidates if _is_true_enough(extremes, law)), REFERENCE)


def _is_true_enough(extremes: Extremes, law: Law) -> bool:
    """Return whether a law stays within the accuracy target of the reference law's force at each speed."""
    scene, liquid = extremes.scene, extremes.liquid
    for k in range(1, _SPEEDS + 1):
        speed_mps = extremes.relative_mps * k / _SPEEDS
        true_n = resistance_n(scene, liquid, speed_mps)
        wrong_n = abs(resistance_n(scene, liquid, speed_mps, law) - true_n)
        if wrong_n > max(scene.accuracy.relative * true_n, scene.accuracy.absolute_n):
            return False
    return True


def _choose(extremes: Extremes) -> tuple[Drag, str]:
    if extremes.liquid.drag.law == "linear":
        return extremes.liquid.drag, "drag law: linear, as specified in the file"
    law, accuracy = cheapest_law(extremes), extremes.scene.accuracy
    if extremes.liquid.viscosity_pa_s is None:
        return Drag(law=law), "drag law: constant, because the liquid's viscosity is not specified"
    if law == REFERENCE:
        return Drag(law=law), f"drag law: {LAW_NAMES[law]}"
    error = f"within {100 * accuracy.relative:g} % or {accuracy.absolute_n:g} N of {LAW_NAMES[REFERENCE]}"
    return Drag(law=law), f"drag law: {LAW_NAMES[law]}, {error}"


def _problem(liquid: Liquid) -> str | None:
    if liquid.drag.law not in {"constant", "linear"} and liquid.viscosity_pa_s is None:
        return f'the drag law "{liquid.drag.law}" needs the liquid\'s viscosity_pa_s'
    return None


def _fill(record: Any, liquid: Liquid, scene: Scene, first: Mapping[str, int]) -> None:
    body = scene.body
    record.law = _LAWS[liquid.drag.law]
    record.factor_kg_m = 0.5 * liquid.density_kg_m3 * body.drag_coefficient * math.pi / 4 * body.diameter_m**2
    if liquid.drag.damping_nspm is not None:
        record.damping_nspm = liquid.drag.damping_nspm / scene.scale
    elif liquid.drag.law != "constant" and liquid.viscosity_pa_s is not None:
        record.stokes_nspm = 3 * math.pi * liquid.viscosity_pa_s * body.diameter_m
        record.reynolds_spm = liquid.density_kg_m3 * body.diameter_m / liquid.viscosity_pa_s


def _bound_n(extremes: Extremes) -> float:
    """Return F(v), by the reference law where the liquid has a viscosity."""
    return resistance_n(extremes.scene, extremes.liquid, extremes.speed_mps)


def _exerted_n(extremes: Extremes) -> float:
    """Return the drag by the liquid's own law, of a body moving against the selected current."""
    return resistance_n(extremes.scene, extremes.liquid, extremes.relative_mps, extremes.liquid.drag.law)


_PARAMETERS: Fields = (
    ("law", INT),  # LAW_*
    ("factor_kg_m", FLOAT),  # ½ ρ C_d A, of the constant law
    ("stokes_nspm", FLOAT),  # 3π µ D, of the laws of the Reynolds number
    ("reynolds_spm", FLOAT),  # ρ D / µ, likewise: Re a unit of speed
    ("damping_nspm", FLOAT),  # b / scale, of the linear law
)

EFFECT = Effect(
    name="drag",
    label="Drag",
    bit=BIT,
    bound_n=_bound_n,
    exerted_n=_exerted_n,
    extent="area",
    choose=_choose,
    note=lambda liquid: f", drag law: {LAW_NAMES[liquid.drag.law]}",
    model=Drag,
    default=Drag(),
    problem=_problem,
    parameters=_PARAMETERS,
    fill=_fill,
    with_liquid=True,
    start=lambda kind, _centre_m, _reach_m: (
        {"law": kind, "damping_nspm": _DAMPING_NSPM} if kind == "linear" else {"law": kind}
    ),
    controls=(
        Parameter(
            "drag.law",
            "Drag law",
            choices=(
                ("constant", "Constant (thesis)"),
                *((law, LAW_NAMES[law]) for law in LAWS),
                ("linear", "Linear damper"),
            ),
        ),
        Parameter(
            "drag.damping_nspm",
            "Damping at the hand",
            unit="N·s/m",
            least=DAMPING_NSPM[0],
            most=DAMPING_NSPM[1],
            logarithmic=True,
        ),
    ),
)
