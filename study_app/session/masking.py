"""How the sound of a haptic device's motors was masked: audible motors can reveal a viscosity."""

from dataclasses import dataclass
from typing import Any, Final, Literal, TypeAlias

Means: TypeAlias = Literal["no", "headphones", "noise"]

MEANS: Final[dict[Means, str]] = {"no": "No", "headphones": "Headphones", "noise": "Noise"}
"""The answers to "Motors masked?", with their words."""

QUIETEST_DB, LOUDEST_DB, USUAL_DB = 30, 85, 60
"""Sound pressure levels of masking noise [dB]; above 85 dB hearing is at risk (Directive 2003/10/EC)."""


@dataclass(frozen=True, slots=True)
class Masking:
    """The operator's answer; ``noise_db`` is the sound pressure level of the noise [dB], None without noise."""

    means: Means = "no"
    noise_db: int | None = None

    @property
    def entry(self) -> dict[str, Any]:
        """The answer as the receipt has it."""
        return {"means": self.means, "noise_db": self.noise_db}
