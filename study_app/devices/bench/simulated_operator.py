"""Answers of a device's simulated hand to a bench's requests to the operator."""

from collections.abc import Callable
from typing import Any

from study_app.devices.bench.measurements import GRAVITY_MPS2
from study_app.devices.bench.procedure import Ask


def asks_hand(device: Any, progress: Callable[[str], object]) -> Ask:
    """Return the function that asks the hand of a simulated device: it releases the handle, or acts as the scale.

    The hand is the device's ``hand``, or the device itself: with ``held`` and the motors' ``force_n``.
    """
    hand = getattr(device, "hand", device)

    def ask(kind: str, words: str) -> Callable[[], str | None]:
        if kind in ("let-go", "scale"):
            hand.held = kind == "scale"
            progress(words)
        if kind == "scale":
            hand.reach_to(0.0, 0.0, 0.0)
        if kind == "damping":
            return lambda: None
        if kind == "grams":
            return lambda: f"{-1e3 * float(hand.force_n[1]) / GRAVITY_MPS2:.1f}"
        return lambda: ""

    return ask
