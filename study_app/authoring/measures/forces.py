"""The force of each liquid against a hand."""

from study_app.haptics.model.slope_limits import HAND_MPS, Steady, steady
from study_app.protocol.model import Protocol


def forces(protocol: Protocol) -> dict[str, Steady]:
    """Return the force of each liquid against a hand at 0.1 m/s."""
    return {name: steady(protocol.scene_of(name), HAND_MPS) for name in protocol.liquids}
