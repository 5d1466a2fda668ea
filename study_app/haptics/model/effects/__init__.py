"""The effects: one descriptor per module, found by importing every module of this folder.

Reading order: added_mass, buoyancy, current, drag, history, non_newtonian, surface, wake; local_wake, unsteady_drag.
"""

from importlib import import_module
from pkgutil import iter_modules
from typing import Final

from study_app.haptics.model.effect import GRAVITY_MPS2, LEAST, MOST, Effect, Parameter, Value
from study_app.haptics.model.effects.current import Vortex
from study_app.haptics.model.effects.drag import DAMPING_NSPM, REFERENCE, Drag, resistance_n
from study_app.haptics.model.effects.local_wake import LocalWake
from study_app.haptics.model.effects.non_newtonian import STIFFNESS_NPM
from study_app.haptics.model.effects.wake import Wake, scaled_length

__all__ = [
    "DAMPING_NSPM",
    "EFFECTS",
    "GRAVITY_MPS2",
    "LEAST",
    "MOST",
    "NAMED",
    "REFERENCE",
    "STIFFNESS_NPM",
    "Drag",
    "Effect",
    "LocalWake",
    "Parameter",
    "Value",
    "Vortex",
    "Wake",
    "resistance_n",
    "scaled_length",
]

EFFECTS: Final[tuple[Effect, ...]] = tuple(
    sorted((import_module(f"{__name__}.{it.name}").EFFECT for it in iter_modules(__path__)), key=lambda it: it.bit)
)
"""Every effect, in the order of its bit."""

NAMED: Final = {effect.name: effect for effect in EFFECTS}
"""The same by name."""

if len({effect.bit for effect in EFFECTS}) < len(EFFECTS) or len(NAMED) < len(EFFECTS):
    raise ValueError(f"two effects share a name or a bit: {[(effect.name, effect.bit) for effect in EFFECTS]}")
