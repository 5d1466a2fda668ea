"""Delays as they were displayed."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Delivered:
    """How far what was shown under one setting differed from what was asked for; ms, over trials.

    Of ``judged`` trials it is known whether they kept to the protocol's limits of timing; ``valid`` ones did.
    """

    block: str
    code: str | None
    delay_ms: float | None
    trials: int
    measured: int
    judged: int
    valid: int
    error_mean_ms: float | None
    error_worst_ms: float | None
    achieved_ms: float | None
