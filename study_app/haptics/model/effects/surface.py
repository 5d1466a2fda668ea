"""Surface: the submerged fraction of the ball, for the effects that depend on it."""

from study_app.haptics.model.effect import FLOAT, Effect, Extremes, Fields, Liquid

BIT = 1 << 5


def _bound_n(extremes: Extremes) -> float | None:
    """Return the sum of the other effects if the centre can cross the surface, else nothing to bound."""
    if not extremes.has_top:
        return None
    area, volume = extremes.doubtful_shares()
    return float(area * extremes.total_n("area") + volume * (extremes.total_n("volume") + extremes.lift_n))


def _problem(liquid: Liquid) -> str | None:
    if liquid.region.kind == "everywhere":
        return 'the effect "surface" needs a region with a top: a box or a cylinder'
    return None


_STATE: Fields = (
    ("volume", FLOAT),  # fraction of the body's volume under the surface
    ("upright", FLOAT),  # fraction of the frontal area of vertical motion
    ("level", FLOAT),  # fraction of the frontal area of horizontal motion
)

EFFECT = Effect(name="surface", label="Surface", bit=BIT, bound_n=_bound_n, problem=_problem, state=_STATE)
