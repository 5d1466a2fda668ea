"""How a sphere's drag depends on the Reynolds number Re = ρ|w|D/µ: plain functions, compiled or not.

Each law gives the drag as a multiple of Stokes', F / (3πµD|w|) = C_d Re / 24, which is 1 at Re = 0 where C_d itself is
infinite. Above Re = 2·10⁵ the drag coefficient keeps its value there: the laws do not model the drag crisis.
``effects.drag`` compiles these functions unchanged; ``gate`` calls them.
"""

import math
from collections.abc import Callable
from typing import Final, Literal, TypeAlias

Law: TypeAlias = Literal["constant", "schiller-naumann", "haider-levenspiel", "brown-lawler", "linear"]

HIGHEST_REYNOLDS: Final = 2e5
_CONSTANT_FROM: Final = 4040.0**0.70


def schiller_naumann(reynolds: float) -> float:
    """Return F/F_Stokes for C_d = max(24/Re (1 + 0.15 Re^0.687), 0.44) (Schiller & Naumann 1933).

    The greater of the two branches, which cross at Re ≈ 990, instead of their switch at 1000: continuous.
    """
    held = min(reynolds, HIGHEST_REYNOLDS)
    ratio = max(1.0 + 0.15 * math.pow(held, 0.687), 0.44 / 24.0 * held)
    return ratio * max(reynolds / HIGHEST_REYNOLDS, 1.0)


def haider_levenspiel(reynolds: float) -> float:
    """Return F/F_Stokes for C_d = 24/Re (1 + 0.1806 Re^0.6459) + 0.4251/(1 + 6880.95/Re).

    Haider & Levenspiel 1989, Powder Technology 58, for spheres, Re ≤ 2·10⁵.
    """
    held = min(reynolds, HIGHEST_REYNOLDS)
    ratio = 1.0 + 0.1806 * math.pow(held, 0.6459) + 0.4251 / 24.0 * held * held / (held + 6880.95)
    return ratio * max(reynolds / HIGHEST_REYNOLDS, 1.0)


def brown_lawler(reynolds: float) -> float:
    """Return F/F_Stokes for C_d = 24/Re (1 + 0.150 Re^0.681) + 0.407/(1 + 8710/Re).

    Brown & Lawler 2003, Journal of Environmental Engineering 129, for spheres, Re ≤ 2·10⁵.
    """
    held = min(reynolds, HIGHEST_REYNOLDS)
    ratio = 1.0 + 0.150 * math.pow(held, 0.681) + 0.407 / 24.0 * held * held / (held + 8710.0)
    return ratio * max(reynolds / HIGHEST_REYNOLDS, 1.0)


def finite_reynolds(reynolds: float) -> float:
    """Return F/F_Stokes for 1 + (3/16) Re/(1 + 0.450 √Re) + (0.486/24) Re/(1 + (4040/Re)^0.70).

    Oseen's term and a constant C_d at great Re, between them fitted to this project's fluid solver: within 1.7 % at
    Re 1 to 200. Used only by ``unsteady_drag``; below Re = 10⁵ within 2.7 % of the mean of the published laws.
    """
    grown = math.pow(reynolds, 0.70)
    oseen = 3.0 / 16.0 * reynolds / (1.0 + 0.450 * math.sqrt(reynolds))
    return 1.0 + oseen + 0.486 / 24.0 * reynolds * grown / (grown + _CONSTANT_FROM)


LAWS: Final[dict[Law, Callable[[float], float]]] = {
    "schiller-naumann": schiller_naumann,
    "haider-levenspiel": haider_levenspiel,
    "brown-lawler": brown_lawler,
}
"""The laws of the Reynolds number, cheapest first."""


def drag_n(
    law: Law,
    speed_mps: float,
    *,
    density_kg_m3: float,
    viscosity_pa_s: float | None,
    diameter_m: float,
    drag_coefficient: float,
) -> float:
    """Return the size of the drag [N] on a sphere at a relative speed, by a law; ``constant`` takes the coefficient."""
    if law == "constant":
        return 0.5 * density_kg_m3 * drag_coefficient * math.pi / 4 * diameter_m**2 * speed_mps**2
    if viscosity_pa_s is None or law not in LAWS:
        raise ValueError(f"the law {law!r} needs a viscosity" if law in LAWS else f"{law!r} is no law of a sphere")
    reynolds = density_kg_m3 * speed_mps * diameter_m / viscosity_pa_s
    return 3 * math.pi * viscosity_pa_s * diameter_m * speed_mps * LAWS[law](reynolds)
