"""History force: the boundary layer around the ball depends on its past acceleration."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Final

from pydantic import Field

from study_app.haptics.model.effect import (
    FLOAT,
    INT,
    Effect,
    Extremes,
    Fields,
    Liquid,
    Parameter,
    Rows,
    Scene,
    rate_per_s,
    smoothing_s,
)
from study_app.haptics.model.ranges import Frozen, Smoothing, within

BIT = 1 << 7
EXPONENTIALS = 10  # of the kernel's tail

SMOOTHING_S: Final = 0.01
_LONGEST_WINDOW_S: Final = 0.5


class History(Frozen):
    """The Basset force: the boundary layer's memory of past accelerations.

    Accelerations older than ``window_s`` are summed in ten exponentials.
    """

    window_s: Annotated[
        float,
        within(
            0.005,
            0.5,
            "the window contains 5 to 500 accelerations at 1 kHz",
            what="Age up to which accelerations are summed individually [s].",
        ),
    ] = 0.05
    smoothing_s: Smoothing | None = Field(
        default=None,
        description="Time over which velocities are first smoothed [s]; the default depends on the velocity estimator.",
    )


def _accelerated_n(extremes: Extremes, acceleration_mps2: float, change_mps: float) -> float:
    """Return 12 R² √(2π ρ µ a v).

    The Basset integral for a body that moved at −v and reversed to v at a, the greatest of any motion in the box.
    """
    liquid = extremes.liquid
    per_root: float = (
        12 * extremes.radius_m**2 * math.sqrt(2 * math.pi * liquid.density_kg_m3 * (liquid.viscosity_pa_s or 0))
    )
    return per_root * math.sqrt(acceleration_mps2 * change_mps)


def _bound_n(extremes: Extremes) -> float | None:
    """Return H(a, v) + H(s v, u) with H of `_accelerated_n`, s the shear of the current and u its speed."""
    return None if extremes.liquid.viscosity_pa_s is None else extremes.inertial_n(_accelerated_n)


def _problem(liquid: Liquid) -> str | None:
    return 'the effect "history" needs the liquid\'s viscosity_pa_s' if liquid.viscosity_pa_s is None else None


def _intervals(window_s: float, rate_hz: float) -> int:
    """Return the number of rows of a window at the scene's rate, with room for a late tick or two."""
    return math.ceil(window_s * rate_hz) + 4


def _fill(record: Any, liquid: Liquid, scene: Scene, first: Mapping[str, int]) -> None:
    history = liquid.history
    record.row = first["intervals"]
    record.rows = _intervals(history.window_s, scene.rate_hz)
    record.tail_row = first["exponentials"]
    record.window_s = history.window_s
    record.filter_per_s = rate_per_s(smoothing_s(scene.velocity, history.smoothing_s, SMOOTHING_S))
    root_kg_m2_rs = math.sqrt(math.pi * liquid.density_kg_m3 * (liquid.viscosity_pa_s or 0.0))
    record.factor_kg_rs = 1.5 * scene.body.diameter_m**2 * root_kg_m2_rs


def damping_nspm(factor_kg_rs: float, filter_per_s: float) -> float:
    """Return about 0.4 H/√τ of a history H smoothed over τ, where a loop becomes unstable [choice]."""
    return float(0.7 * factor_kg_rs * math.sqrt(filter_per_s)) if math.isfinite(filter_per_s) else 0.0


_PARAMETERS: Fields = (
    ("row", INT),  # its first row in the model's intervals
    ("rows", INT),  # how many it owns
    ("tail_row", INT),  # its first row in the model's exponentials
    ("factor_kg_rs", FLOAT),  # 6 R² √(π ρ µ) [kg/√s]
    ("window_s", FLOAT),
    ("filter_per_s", FLOAT),  # 1/τ of the velocity
)

_STATE: Fields = (
    ("first", INT),  # where in its rows the oldest interval is; the others follow, around the end
    ("held", INT),  # how many there are
    ("smoothed_mps", FLOAT, (3,)),  # w, smoothed once
    ("twice_mps", FLOAT, (3,)),  # and twice
)

_INTERVAL: Fields = (
    ("acceleration_mps2", FLOAT, (3,)),  # mean dw/dt
    ("duration_s", FLOAT),
)

_EXPONENTIAL: Fields = (("memory", FLOAT, (3,)),)  # of the kernel's tail, times dw/dt [m/s / √s]

EFFECT = Effect(
    name="history",
    label="History",
    bit=BIT,
    bound_n=_bound_n,
    exerted_n=_bound_n,
    extent="volume",
    accelerated_n=_accelerated_n,
    model=History,
    default=History(),
    problem=_problem,
    parameters=_PARAMETERS,
    state=_STATE,
    fill=_fill,
    rows=(
        Rows(
            "history intervals",
            {"intervals": _INTERVAL},
            lambda liquid, rate_hz: _intervals(liquid.history.window_s, rate_hz),
            lambda rate_hz: _intervals(_LONGEST_WINDOW_S, rate_hz),
        ),
        Rows(
            "history exponentials",
            {"exponentials": _EXPONENTIAL},
            lambda liquid, rate_hz: EXPONENTIALS,
            lambda rate_hz: EXPONENTIALS,
        ),
    ),
    damping_nspm=lambda record, rate: damping_nspm(record.factor_kg_rs, rate * record.filter_per_s),
    adjustable=False,  # its intervals depend on its numbers
    open_values={"smoothing_s": lambda scene: smoothing_s(scene.velocity, None, SMOOTHING_S)},
    controls=(
        Parameter("history.window_s", "Window", unit="s", factor=1e3, shown_unit="ms", decimals=0),
        Parameter("history.smoothing_s", "Smoothing", unit="s", most=0.2, factor=1e3, shown_unit="ms", decimals=1),
    ),
)
