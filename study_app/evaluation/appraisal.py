"""What is found of a scene that was appraised: what it costs, and how true it is."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class EffectCost:
    """What an effect takes of a tick [ns]; None where it is not there, and why."""

    effect: str
    ns: float | None
    why: str = ""


@dataclass(frozen=True, slots=True)
class Costs:
    """What a scene takes: a tick of it, one of a scene without liquids, and each effect [ns]."""

    tick_ns: float
    rest_ns: float
    effects: tuple[EffectCost, ...]


@dataclass(frozen=True, slots=True)
class Errors:
    """How far a scene is from the exact definition (``evaluation.reference_model``), along programmed paths.

    ``wake`` is the largest difference as a share of Σ|e|/S, ``force_n`` that of the forces [N]; None where there is no
    reference. ``lag_s`` is how late the velocity filter is on a motion that speeds up evenly. ``left_out`` are effects
    that were not compared. ``withheld`` is the share of the force that safety withholds in the stroke that was asked
    about (``evaluation.appraisal_measurement``), None without one.
    """

    wake: float | None
    force_n: float | None
    lag_s: float
    left_out: tuple[str, ...]
    withheld: float | None = None
