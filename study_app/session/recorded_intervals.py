"""Intervals in recordings: the scenes presented, and the delivered levels, compared with the journal."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

import numpy as np

from study_app.haptics.model.layout import LIMITER_GLITCH
from study_app.haptics.model.scene import Scene
from study_app.haptics.runtime.offline import law_along
from study_app.protocol.model import Protocol
from study_app.protocol.trials.presentation import presented_by, scene_of
from study_app.protocol.trials.stimuli import Stimulated
from study_app.protocol.trials.tracks import adjusting_of, design_of
from study_app.store.blinded.blinding import Key
from study_app.store.delivered import Delivered, delivered, delivered_error, judged
from study_app.store.journals.journal import Line

TOLERANCE: Final = 1e-9


def scene_presented(protocol: Protocol, key: Key, started: Line, link_seed: int) -> Scene:
    """Return the presented scene: of a condition, or of an interval of a trial whose sealed line is opened.

    ``link_seed`` is that of jitter and loss of the force.
    """
    if "interval" not in started:
        return scene_of(protocol, Stimulated(key.condition(started["block"], started["code"])), link_seed)
    due = presented_by(protocol, key.codes, started)
    return scene_of(protocol, due.intervals[started["interval"] - 1], link_seed)


@dataclass(frozen=True, slots=True)
class Step:
    """A step of a setting: the number of its scene in telemetry, from that tick on, and the scene."""

    serial: int
    scene: Scene


def steps_of(protocol: Protocol, key: Key, started: Line, lines: Sequence[Line]) -> tuple[Step, ...]:
    """Return the steps of an interval that a force depends on, in order; none where no level was set.

    ``started`` is the opened line on the trial's beginning, of a trial of intervals with the ``interval``; ``lines`` is
    the session's journal.
    """
    if "interval" not in started:
        return ()
    presented = presented_by(protocol, key.codes, started).intervals[started["interval"] - 1]
    which = started["trial"], started["attempt"]
    made = [line for line in lines if line["event"] == "stepped" and (line["trial"], line["attempt"]) == which]
    setting = adjusting_of(protocol, protocol.blocks[started["block"]], started["standard"], started["level"])
    if setting is None or started["interval"] != len(started["arrangement"]):
        return ()
    place, steps = 0, []
    for line in made:
        place = setting.moved(place, line["steps"])
        if line["scene"] is not None:
            steps.append(Step(line["scene"], scene_of(protocol, replace(presented, value=setting.comparison(place)))))
    return tuple(steps)


def as_one_scene(samples: Any, steps: Sequence[Step]) -> Any:
    """Return samples (n,) in which the scenes of an interval have the number of the last of them."""
    if not steps or len(samples) == 0:
        return samples
    out = samples.copy()
    out.scene[samples.scene >= steps[0].serial - 1] = samples.scene[-1]
    return out


def places_of(samples: Any, steps: Sequence[Step]) -> list[tuple[int, Scene]]:
    """Return the first of the samples (n,) of each step with its scene; steps that no sample follows are left out."""
    found = ((np.flatnonzero(samples.scene >= step.serial), step.scene) for step in steps)
    return [(int(at[0]), scene) for at, scene in found if at.size]


def interval_samples(samples: Any, duration_s: float) -> Any:
    """Return the samples of an interval's task from its recording, which begins before it and ends after it.

    ``duration_s`` is the duration of the task in the journal.
    """
    own = samples[samples["scene"] == samples["scene"][-1]]
    believed = own[own["limiters"] & LIMITER_GLITCH == 0]
    until_ns = believed["time_ns"][:1] + round(duration_s * 1e9)
    return own[own["time_ns"] <= until_ns]


def delivered_again(
    protocol: Protocol, presented: Stimulated, started: Mapping[str, Any], samples: Any, ended: Mapping[str, Any]
) -> Delivered:
    """Return the delivered values of an interval, from the samples of its recording.

    ``started`` and ``ended`` are the opened lines on the beginning of the trial, with the ``interval``, and on the
    interval's end.
    """
    block = protocol.blocks[started["block"]]
    adjusted = design_of(protocol, block).adjusts and started["interval"] == len(started["arrangement"])
    own = judged(interval_samples(samples, ended["duration_s"]))
    return delivered(protocol, presented, protocol.tasks[block.task], own, adjusted=adjusted)


def error_again(scene: Scene, rate_hz: float, samples: Any, ended: Mapping[str, Any]) -> float | None:
    """Return the error of the force sent in a trial or interval, from its recording and the opened line on its end."""
    own = judged(interval_samples(samples, ended["duration_s"]))
    return delivered_error(own, rate_hz, scene.fade_s, partial(law_along, scene))


def different(found: Mapping[str, float | None], ended: Mapping[str, Any]) -> Iterator[str]:
    """Yield the columns in which the journal differs from the recomputed values; none if it lacks them."""
    for name, value in found.items():
        if name in ended and not _same(value, ended[name]):
            yield name


def _same(one: float | None, other: float | None) -> bool:
    if one is None or other is None:
        return one is other
    return bool(np.isclose(one, other, rtol=TOLERANCE, atol=TOLERANCE))
