"""What intervals delivered, computed again from their recordings and compared with the journal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np

from study_app.haptics.model.layout import LIMITER_GLITCH
from study_app.protocol.model import Protocol
from study_app.protocol.trials.stimuli import Stimulated
from study_app.store.tables.delivered import Delivered, delivered, judged

TOLERANCE: Final = 1e-9


def interval_samples(samples: Any, duration_s: float) -> Any:
    """Return the samples of an interval's task from those of its recording, which begins before it and ends after it.

    Parameters
    ----------
    samples : recarray of ``layout.SAMPLE`` (n,)
        The recording.
    duration_s : float
        How long the task took, as the journal has it [s].
    """
    own = samples[samples["scene"] == samples["scene"][-1]]
    believed = own[own["limiters"] & LIMITER_GLITCH == 0]
    until_ns = believed["time_ns"][:1] + round(duration_s * 1e9)
    return own[own["time_ns"] <= until_ns]


def delivered_again(
    protocol: Protocol, presented: Stimulated, block: str, samples: Any, ended: Mapping[str, Any]
) -> Delivered:
    """Return what an interval of a block delivered, by its recording; ``ended`` is the opened line on its end."""
    task = protocol.tasks[protocol.blocks[block].task]
    return delivered(protocol, presented, task, judged(interval_samples(samples, ended["duration_s"])))


def different(found: Delivered, ended: Mapping[str, Any]) -> Iterator[str]:
    """Yield the columns in which the journal differs from what was computed again; nothing where it has none."""
    for name, value in found.columns.items():
        if name in ended and not _same(value, ended[name]):
            yield name


def _same(one: float | None, other: float | None) -> bool:
    if one is None or other is None:
        return one is other
    return bool(np.isclose(one, other, rtol=TOLERANCE, atol=TOLERANCE))
