"""SIMULATED participants, for rehearsals: they read, explore, reach for what they see lit, and answer what they felt.

What such a participant knows is what a person would know: the pages, the tank as it was drawn (as late as that was),
and the force on the hand. Nothing here knows a condition.
"""

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np

from study_app.devices.simulated.hand_commands import HandOrders
from study_app.protocol.model import Explore, Follow, Reach
from study_app.protocol.questions import ItemView, Value, shown
from study_app.protocol.simulated_observer import Rater, TrialFeatures, judgements
from study_app.protocol.trials.tasks import AnyTask
from study_app.psychophysics.delivery import lag
from study_app.session.pages import DesignPage, QuestionnairePage, TextPage
from study_app.session.simulated.exploration import exploration
from study_app.session.trial import TankView
from study_app.store.delivered import LONGEST_S

Draw = Callable[[], float]

SECONDS_PER_WORD = 0.12
REACTION_S = (0.2, 0.35)  # from seeing a target lit to moving
ANSWER_S = (0.8, 2.6)
CHANGES_MIND = 0.08
AIM_ERROR = 0.3  # of a target's radius, at most, along each axis
FOLLOWED_HZ = 200.0
CORRECTION_S = 0.35  # the hand was still for so long outside the target before it tries again


def reading_s(page: TextPage) -> float:
    """Return how long it takes to read a page [s]."""
    return 1.0 + SECONDS_PER_WORD * sum(len(paragraph.split()) for paragraph in (page.title, *page.paragraphs))


@dataclass(slots=True)
class SensedTrial:
    """What reached hand and eyes in one trial; ``scale`` is scene metres per hand metre.

    ``period_s`` is the time between two ticks [s] in studies that delay the force, else None.
    """

    scale: float
    period_s: float | None = None
    forces_n: list[Any] = field(default_factory=list)
    velocities_mps: list[Any] = field(default_factory=list)
    model_n: list[Any] = field(default_factory=list)
    ages_s: list[float] = field(default_factory=list)

    def feel(self, samples: Any) -> None:
        """Take what the hand felt (recarray of ``layout.SAMPLE``), where there was a liquid."""
        wet = samples[samples["scene"] != 0]
        self.forces_n.append(wet["device_force_n"])
        self.velocities_mps.append(wet["velocity_mps"])
        if self.period_s is not None:
            self.model_n.append(wet["force_n"])

    def see(self, painted_ns: int, view: TankView) -> None:
        """Take a frame that was seen."""
        self.ages_s.append((painted_ns - view.sample_time_ns) * 1e-9)

    def clear(self) -> None:
        """Forget what came so far."""
        for came in (self.forces_n, self.velocities_mps, self.ages_s):
            came.clear()

    def features(self) -> TrialFeatures:
        """Return the features that an opinion is made of."""
        force_n = np.concatenate(self.forces_n or [np.zeros((0, 3))])
        velocity_mps = np.concatenate(self.velocities_mps or [np.zeros((0, 3))]) / self.scale
        norm_n = _norm(force_n)
        power_w = np.einsum("ij,ij->i", force_n, velocity_mps)
        effort_w = float(np.abs(power_w).sum())
        changes_n = _norm(np.diff(force_n, axis=0))
        return TrialFeatures(
            force_mean_n=_mean(norm_n),
            force_peak_n=float(norm_n.max(initial=0.0)),
            speed_rms_mps=math.sqrt(_mean(_norm(velocity_mps) ** 2)),
            push_share=float(power_w[power_w > 0].sum()) / effort_w if effort_w > 0 else 0.0,
            roughness_n=math.sqrt(_mean(changes_n**2)),
            delay_s=_mean(np.asarray(self.ages_s)),
            force_delay_s=self._force_delay_s(force_n),
        )

    def _force_delay_s(self, force_n: Any) -> float:
        """Return how late the force was sent [s]."""
        if self.period_s is None or not self.model_n:
            return 0.0
        rows = lag(force_n, np.concatenate(self.model_n), round(LONGEST_S / self.period_s))
        return 0.0 if rows is None else max(rows * self.period_s, 0.0)


class Explorer:
    """Moves about for a while that it likes, then wants to go on."""

    def __init__(self, task: Explore, device: HandOrders, draw: Draw, now_s: float) -> None:
        stay_s = task.min_s + (0.1 + 0.2 * draw()) * max(task.min_s, 5.0)
        self._leave_s = now_s + min(stay_s, task.max_s)
        device.follow(*exploration(draw, device.workspace_m, stay_s))

    def act(self, now_s: float, _view: TankView) -> bool:
        """Return whether the space bar is pressed."""
        return now_s >= self._leave_s


class Reacher:
    """Reaches for the target that is seen lit, and tries again where the ball is seen to have come to rest outside."""

    def __init__(self, task: Reach, device: HandOrders, draw: Draw) -> None:
        self._task = task
        self._device = device
        self._draw = draw
        self._seen: int | None = None
        self._move_s = 0.0
        self._outside_since_s: float | None = None

    def act(self, now_s: float, view: TankView) -> bool:
        """Move the hand as what is seen asks for; the space bar is never pressed."""
        lit = view.task.lit
        if lit is None:
            return False
        if lit != self._seen:
            self._seen = lit
            self._move_s = now_s + _between(self._draw, *REACTION_S)
            self._outside_since_s = None
        elif self._move_s and now_s >= self._move_s:
            self._reach_for(lit)
        elif not self._move_s and not self._device.moving:
            self._correct(now_s, view, lit)
        return False

    def _correct(self, now_s: float, view: TankView, lit: int) -> None:
        if math.dist(view.position_m.tolist(), self._task.targets_m[lit]) <= self._task.radius_m:
            self._outside_since_s = None
        elif self._outside_since_s is None:
            self._outside_since_s = now_s
        elif now_s - self._outside_since_s >= CORRECTION_S:
            self._outside_since_s = None
            self._reach_for(lit)

    def _reach_for(self, target: int) -> None:
        self._move_s = 0.0
        error_m = AIM_ERROR * self._task.radius_m
        x, y, z = (place + error_m * _between(self._draw, -1, 1) for place in self._task.targets_m[target])
        self._device.reach_to(x, y, z)


class Follower:
    """Moves with the target, whose even swing it anticipates, with the error of an aim."""

    def __init__(self, task: Follow, device: HandOrders, draw: Draw) -> None:
        t_s = np.arange(round(task.limit_s * FOLLOWED_HZ) + 1) / FOLLOWED_HZ
        error_m = AIM_ERROR * task.radius_m
        path_m = np.array([task.target_m(float(t)) for t in t_s])
        path_m += np.array([error_m * _between(draw, -1, 1) for _ in range(3)]) * np.minimum(t_s, 1.0)[:, np.newaxis]
        device.follow(t_s, path_m)

    def act(self, _now_s: float, _view: TankView) -> bool:
        """Return that the space bar is not pressed: time ends the task."""
        return False


Hand: TypeAlias = Explorer | Reacher | Follower


def hand_for(task: AnyTask, device: HandOrders, draw: Draw, now_s: float) -> Hand:
    """Return who does a task with a simulated hand, from ``now_s`` on [s]."""
    match task:
        case Explore():
            return Explorer(task, device, draw, now_s)
        case Reach():
            return Reacher(task, device, draw)
        case Follow():
            return Follower(task, device, draw)


def rest(task: AnyTask, device: HandOrders) -> None:
    """Let a simulated hand rest after a task: where its next interval begins, if that begins at a place."""
    if task.start_m is None:
        device.rest()
    else:
        device.reach_to(*task.start_m)


@dataclass(frozen=True, slots=True)
class Choice:
    """``value`` for ``item``, ``after_s`` after the choice before."""

    item: str
    value: Value
    after_s: float


def filled_in(page: QuestionnairePage, felt: TrialFeatures, person: Rater, draw: Draw) -> list[Choice]:
    """Return how a page is answered by what was felt."""
    judged = judgements([item.id for item in page.items], felt, person, draw)
    answers = {item.id: item.simulated(judged[item.id], draw) for item in page.items}
    asked = shown(page.items, answers)
    return choices([item for item in page.items if item.id in asked], answers, draw)


def choices(
    items: Iterable[ItemView], answers: Mapping[str, Value], draw: Draw, *, changes_mind: bool = True
) -> list[Choice]:
    """Return how answers are given: one after the other, sometimes first one nearby."""
    given: list[Choice] = []
    for item in items:
        value = answers[item.id]
        if changes_mind and draw() < CHANGES_MIND and (nearby := item.nearby(value)) != value:
            given.append(Choice(item.id, nearby, _between(draw, *ANSWER_S)))
        given.append(Choice(item.id, value, _between(draw, *ANSWER_S)))
    return given


def newly_shown(
    page: QuestionnairePage | DesignPage, answers: Mapping[str, Value], seen: Collection[str]
) -> tuple[str, ...]:
    """Return which questions of a page appear by the answers so far."""
    return tuple(item for item in shown(page.items, answers) if item not in seen)


def _between(draw: Draw, low: float, high: float) -> float:
    return low + (high - low) * draw()


def _mean(values: Any) -> float:
    return float(values.mean()) if len(values) else 0.0


def _norm(vectors: Any) -> Any:
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
