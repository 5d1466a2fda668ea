"""The settings and the liquids that the lab begins with."""

from dataclasses import dataclass
from typing import Final

from study_app.gui.participant.tank import caustics
from study_app.lab.ab_comparison import Workbench
from study_app.lab.presets import Choice, liquids_at_hand

INITIAL_A: Final = Choice("rek2024", "water", "Water")
INITIAL_B: Final = Choice("rek2024", "light_oil", "Light oil")


@dataclass(frozen=True, slots=True)
class InitialSettings:
    """What the lab begins with: both settings, and the liquids at hand."""

    bench: Workbench
    liquids: tuple[Choice, ...]


def prepare_initial_settings() -> InitialSettings:
    """Read the initial settings and compute the tank's light; may run in any thread."""
    caustics.brightness()
    return InitialSettings(Workbench(INITIAL_A.setting(), INITIAL_B.setting()), liquids_at_hand())
