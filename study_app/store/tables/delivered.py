"""Whether an interval was delivered as requested: what its samples show, and which limits of the study it breaks.

The session asks at the end of each interval, the analysis of the recording of the same interval. Forces are taken as
recordings have them, so that both compute the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from study_app.haptics.model.layout import FORCE_STEP_N, LIMITER_GLITCH, LIMITER_NORM, SAMPLE
from study_app.protocol.model import Protocol
from study_app.protocol.trials.due import Due
from study_app.protocol.trials.limits import Limits
from study_app.protocol.trials.stimuli import DELAY, Stimulated
from study_app.protocol.trials.task import AnyTask
from study_app.protocol.trials.tasks.follow import Follow
from study_app.psychophysics.delivery import at, damping, difference, motion, share

FORCES: Final = ("device_force_n", "force_n")
"""What was sent to the hand, and what the force model asked for."""
DAMPING: Final = "damping_nspm"
SETTLED_S: Final = 0.2
"""A task without a lead is judged from so long after its force has faded in [s]."""


JUDGED: Final = np.dtype(
    [(name, SAMPLE[name]) for name in ("time_ns", "position_m", "force_n", "device_force_n", "limiters")]
)
"""The fields of a sample that the delivered level is computed from."""


def judged(samples: Any) -> Any:
    """Return the fields `JUDGED` of samples (n,): a third of the bytes."""
    found = np.empty(len(samples), JUDGED)
    for name in JUDGED.fields or ():
        found[name] = samples[name]
    return found


@dataclass(frozen=True, slots=True, repr=False)
class Delivered:
    """What an interval delivered; names and meanings are those of the columns of ``intervals``.

    ``clipped`` is whether the force limit cut what was judged.
    """

    value_delivered: float | None
    force_share: float | None
    apparent_mass_kg: float | None
    pace_mps: float
    clipped: bool

    @property
    def columns(self) -> dict[str, float | None]:
        """What the interval's row records of it."""
        return {name: value for name, value in asdict(self).items() if name != "clipped"}


def delivered(protocol: Protocol, presented: Stimulated, task: AnyTask, samples: Any) -> Delivered:
    """Return what an interval delivered.

    Parameters
    ----------
    protocol : Protocol
        The study.
    presented : Stimulated
        What was requested.
    task : AnyTask
        The task that was done.
    samples : array of `JUDGED` (n,)
        The interval's samples, from the first one that its task took to the one that ended it.
    """
    samples = _believed(samples)
    times_s = (samples["time_ns"] - samples["time_ns"][:1]) * 1e-9
    fade_s = protocol.scene.fade_s
    from_s = max(task.lead_s, fade_s) if isinstance(task, Follow) else fade_s + SETTLED_S
    moved = motion(times_s, samples["position_m"], 1 / protocol.device.rate_hz).after(from_s)
    first = int(np.searchsorted(times_s, from_s))
    sent_n, model_n = (np.rint(samples[name][first:] / FORCE_STEP_N) * FORCE_STEP_N for name in FORCES)
    fitted = damping(at(moved.times_s, times_s[first:], sent_n), moved) if len(moved.times_s) else None
    value = presented.value if presented.vary not in {None, DELAY} else None
    if varies_damping(presented):
        value = None if fitted is None else fitted[0]
    return Delivered(
        value_delivered=value,
        force_share=share(sent_n, model_n),
        apparent_mass_kg=None if fitted is None else fitted[1],
        pace_mps=moved.rms_speed_mps,
        clipped=bool((samples["limiters"][first:] & LIMITER_NORM).any()),
    )


def _believed(samples: Any) -> Any:
    """Return samples without the positions that were refused."""
    glitches = samples["limiters"] & LIMITER_GLITCH != 0
    return samples[~glitches] if glitches.any() else samples


def varies_damping(presented: Stimulated) -> bool:
    """Return whether the varied number is the damping of a linear law, which can be measured at the hand."""
    return (presented.vary or "").rpartition(".")[2] == DAMPING


def undelivered(limits: Limits, presented: Stimulated, task: AnyTask, found: Delivered) -> Iterator[str]:
    """Yield the keys of the file's limits that an interval breaks: reasons without a number."""
    most = limits.level_error_percent
    if presented.vary not in {None, DELAY} and most is not None:
        measured = found.value_delivered if varies_damping(presented) else found.force_share
        asked = presented.value if varies_damping(presented) else 1.0
        if abs((measured or 0.0) - asked) > abs(asked) * most / 100:  # nothing was delivered to a hand at rest
            yield "level_error_percent"
        if found.clipped:
            yield "force_limit_n"
    if isinstance(task, Follow) and limits.pace_error_percent is not None:
        pace = task.rms_speed_mps
        if abs(found.pace_mps - pace) > pace * limits.pace_error_percent / 100:
            yield "pace_error_percent"


def missed(limits: Limits, due: Due, holds: Sequence[bool], errors_ms: Sequence[float | None]) -> Iterator[str]:
    """Yield the key of the limit that a whole trial breaks: the delays of its intervals do not differ as requested.

    Parameters
    ----------
    limits : Limits
        Those of the study.
    due : Due
        What the trial presented.
    holds : sequence of bool
        Its arrangement: of each interval whether it presented the comparison.
    errors_ms : sequence of float or None
        Of each interval the mean error of the visual delay [ms].
    """
    if limits.level_error_ms is None or due.intervals[0].vary != DELAY or len(errors_ms) < len(holds):
        return
    missed_ms = difference(errors_ms, holds)
    if missed_ms is not None and abs(missed_ms) > limits.level_error_ms:
        yield "level_error_ms"
