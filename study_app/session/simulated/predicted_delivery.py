"""Predict, for a device's delay, how many trials are lost because the safety layer withholds too much force.

A simulated participant performs the task of each scene `_MOTIONS` times. A trial of intervals is lost (missing) if
every presentation has an interval in which more than `limits.withheld_percent` of the force is withheld. Another trial
violates the limits if that happens in its only presentation.
"""

from collections.abc import Iterator, Mapping
from math import prod
from statistics import mean
from typing import Final

from study_app.devices.hand import hand_of
from study_app.devices.rig import Rig, study_settings
from study_app.devices.simulated import ScriptedDevice
from study_app.haptics.model.scene import Scene
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo
from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.orders import orders_of, variants
from study_app.protocol.presented import extreme_levels
from study_app.protocol.randomization import stream
from study_app.protocol.trials import AnyTask
from study_app.session.preflight import PredictedDelivery
from study_app.session.simulated.observers import task_path

_MOTIONS: Final = 5
_MAX_TASK_S: Final = 4.0
"""Longest simulated part of a task [s]."""
_REST_S: Final = 1.0
"""Time without force between two motions, in which the hand moves to the next start [s]."""
_CHUNK_S: Final = 0.5


def predicted_delivery(protocol: Protocol, delay_ticks: int) -> PredictedDelivery:
    """Predict the main trials that a simulated participant would lose on a device with this delay [ticks].

    If sessions differ, for example between groups, the prediction is that of the session which loses most trials.
    """
    with _late_rig(protocol, delay_ticks) as rig:
        failing_scenes = _FailingScenes(protocol, rig)
        proportions = {block.id: _lost_fraction(protocol, block, failing_scenes) for block in protocol.main_blocks}
    return max(
        (_predict_session(variant.protocol, proportions) for variant in variants(protocol)),
        key=lambda prediction: (prediction.missing, prediction.out),
    )


def _predict_session(protocol: Protocol, shares: Mapping[str, float]) -> PredictedDelivery:
    """Return the predicted loss of one kind of session; ``shares`` has the lost fraction of each main block."""
    lost: dict[bool, float] = {True: 0.0, False: 0.0}
    trials: dict[bool, int] = {True: 0, False: 0}
    for block in orders_of(protocol).blocks:
        if block.id in shares:
            has_intervals = protocol.blocks[block.id].design is not None
            lost[has_intervals] += block.trials * shares[block.id]
            trials[has_intervals] += block.trials
    return PredictedDelivery(
        missing=round(lost[True]),
        asked=trials[True],
        out=round(lost[False]),
        judged=trials[False],
        limit_percent=protocol.limits.withheld_percent,
    )


def _late_rig(protocol: Protocol, delay_ticks: int) -> Rig:
    """Return a simulated hand with a device delay of ``delay_ticks``, and its servo on a virtual clock."""
    settings = study_settings(protocol, stream(0, "predicted/hand"))
    x_m, y_m, z_m = (size / 2 for size in settings.workspace_m)
    device = ScriptedDevice(settings.random, workspace_m=(x_m, y_m, z_m), force_limit_n=settings.force_limit_n)
    device.state.handle.delay = delay_ticks
    return Rig(device, Servo(device, clock=VirtualClock(), rate_hz=settings.rate_hz, elements=settings.elements))


def _withheld_shares(
    rig: Rig, scene: Scene, task: AnyTask, workspace_m: tuple[float, float, float]
) -> tuple[float, ...]:
    """Return the proportion of a scene's force that is withheld in each of `_MOTIONS` simulated motions of a task.

    Parameters
    ----------
    rig : Rig
        The rig of `_late_rig`.
    scene : Scene
        The liquid.
    task : AnyTask
        The task of the simulated hand.
    workspace_m : tuple of float
        Full sizes of the tank [m, hand frame].
    """
    servo, hand = rig.servo, hand_of(rig.device)
    assert hand is not None  # noqa: S101 - a scripted device has one
    reader, proportions = servo.telemetry.reader(), list[float]()
    for seed in range(_MOTIONS):
        path_s, path_m = task_path(task, workspace_m, min(task.expected_s, _MAX_TASK_S), seed)
        hand.reach_to(*path_m[0].tolist())
        servo.advance(round(_REST_S * servo.rate_hz))
        serial = servo.load(scene)
        hand.follow(path_s, path_m)
        reader.read()
        permitted_n = withheld_n = 0.0
        for _ in range(round(path_s[-1] / _CHUNK_S)):
            servo.advance(round(_CHUNK_S * servo.rate_hz))
            samples = reader.read()
            in_liquid = samples[samples["scene"] == serial]
            permitted_n += float(in_liquid["permitted_n"].sum())
            withheld_n += float(in_liquid["withheld_n"].sum())
        servo.rest()
        proportions.append(withheld_n / permitted_n if permitted_n > 0.0 else 0.0)
    return tuple(proportions)


class _FailingScenes:
    """Cached fractions of simulated motions that violate the limit, by scene and task."""

    def __init__(self, protocol: Protocol, rig: Rig) -> None:
        self._protocol, self._rig = protocol, rig
        self._known: dict[tuple[Scene, str], float] = {}

    def share(self, scene: Scene, task: str) -> float:
        """Return the fraction of a task's motions in which more force is withheld than the limit permits."""
        if (cached := self._known.get((scene, task))) is not None:
            return cached
        protocol, limit = self._protocol, self._protocol.limits.withheld_percent / 100
        proportions = _withheld_shares(self._rig, scene, protocol.tasks[task], protocol.device.workspace_m)
        self._known[scene, task] = mean(proportion > limit for proportion in proportions)
        return self._known[scene, task]


def _lost_fraction(protocol: Protocol, block: Block, scenes: _FailingScenes) -> float:
    """Return the probability that a trial of a block is missing or, without intervals, violates limits."""

    def failing_fraction(scene: Scene) -> float:
        return scenes.share(scene, block.task)

    if block.design is None:
        return mean(failing_fraction(protocol.scene_for(name)) for name in block.conditions)
    design, attempts = protocol.design_of(block), protocol.limits.attempts or 1

    def missing(standard: float, comparison: float) -> float:
        delivered = [
            prod(1 - (comparison if is_comparison else standard) for is_comparison in arrangement)
            for arrangement in design.arrangements
        ]
        return mean((1 - proportion) ** attempts for proportion in delivered)

    if block.standard is None:
        return mean(missing(0.0, failing_fraction(scene)) for scene in _extreme_scenes(protocol, block))
    standard = failing_fraction(protocol.scene_for(block.standard))
    others = (protocol.scene_for(name) for name in block.conditions if name != block.standard)
    return mean(missing(standard, failing_fraction(scene)) for scene in others)


def _extreme_scenes(protocol: Protocol, block: Block) -> Iterator[Scene]:
    """Yield the scenes of the strongest and weakest level of each standard; for delays, that of the condition."""
    scenes = [scene for _, _, scene in extreme_levels(protocol, block)]
    yield from scenes or map(protocol.scene_for, protocol.conditions_in(block.id))
