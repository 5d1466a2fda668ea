"""What damping a sampled loop bears: the table behind the slope limit, which knows nothing of compiled code."""

from __future__ import annotations

from typing import Final

from study_app.errors import StudyError

# Greatest damping a free 0.1 kg handle bears [N·s/m at the hand], over tick period [s] and delay [ticks].
SLOPE_LIMITS: Final = (
    (0.5e-3, 4, 40.0),
    (1e-3, 1, 60.0),
    (1e-3, 2, 40.0),
    (1e-3, 4, 20.0),
    (2e-3, 1, 30.0),
    (2e-3, 2, 20.0),
    (2e-3, 4, 10.0),
    (4e-3, 1, 15.0),
    (4e-3, 2, 10.0),
    (4e-3, 4, 6.0),
)


def slope_limit(period_s: float, delay_ticks: int) -> float:
    """Return the greatest damping at the hand [N·s/m] for a tick period [s] and a delay of the loop [ticks].

    The best of the table's entries that are no faster and no less delayed: between two, the worse one counts.

    Raises
    ------
    StudyError
        A loop slower or more delayed than any entry.
    """
    known = [limit for period, delay, limit in SLOPE_LIMITS if period >= period_s * (1 - 1e-9) and delay >= delay_ticks]
    if not known:
        raise StudyError(
            f"no stable force is known for {1 / period_s:g} ticks a second with {delay_ticks} ticks of delay: "
            "run at 250 Hz or more, with a delay of 4 ticks at most"
        )
    return max(known)
