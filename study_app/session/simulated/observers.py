"""SIMULATED participants, for rehearsals: they read, explore, reach for lit targets, and answer from what they felt.

A simulated participant has the same information as a person: the pages, the tank as drawn (with its delay), and the
force on the hand, but never a condition. A tank is explored by strokes, circles, zigzags and stops, in rounds of random
order. Only sums, products, quotients and square roots of the drawn numbers are used, so that a seed gives the same
motion on every computer.
"""

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from pkgutil import resolve_name
from typing import Any, Final, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.devices.hand import HandOrders
from study_app.protocol.questions import ItemView, Value, shown_questions
from study_app.protocol.randomization import shuffle, stream
from study_app.protocol.simulated import Rater, TrialFeatures, judgements
from study_app.protocol.trials import Reach, Task
from study_app.psychophysics.delivery import lag
from study_app.session.pages import DesignPage, QuestionnairePage, TextPage
from study_app.session.tasks import TankView, new_tracker
from study_app.store.session_progress import LONGEST_S

Floats: TypeAlias = NDArray[np.float64]
Draw: TypeAlias = Callable[[], float]
RATE_HZ = 200.0
_PACE_MPS = (0.06, 0.22)  # slowest and fastest mean speed of a stroke [m/s]
_REST_S = (0.3, 0.9)  # a stop after each figure, in which the liquid's response is felt
_CORNERS = 128
_TURN = complex(0.9987954562051724, 0.049067674327418015)  # angle to the next corner of the circle
_Figure: TypeAlias = Callable[[Draw, Floats, Floats], list[Floats]]
_SECONDS_PER_WORD = 0.12
_REACTION_S = (0.2, 0.35)  # reaction time from a lit target to the movement [s]
ANSWER_S = (0.8, 2.6)
_REVISION_PROBABILITY = 0.08
_AIM_ERROR = 0.3  # largest error of aim along each axis, as a fraction of the target's radius
_PATH_RATE_HZ = 200.0
_CORRECTION_S = 0.35  # time at rest outside the target before another attempt [s]
_LONGEST_PATH_S: Final = 60.0
"""Time after which the path repeats, unless the task ends earlier [s]."""
_BEFORE_END_S: Final = 0.1
_MOVE_S: Final = 0.8
_STAY_S: Final = 0.2
"""Time at a target beyond the dwell time [s]."""
_RETURN_S: Final = 0.25
"""Time of the return to the middle after a task, shorter than the shortest pause between intervals [s]."""
_SAMPLE = np.dtype([("time_ns", np.int64), ("position_m", np.float64, 3)])


@dataclass(slots=True, kw_only=True)
class SensedTrial:
    """The forces felt and frames seen in one trial; ``scale`` is scene metres per hand metre.

    ``period_s`` is the tick period [s] in studies with a delayed force, else None.
    """

    scale: float
    period_s: float | None = None
    forces_n: list[Any] = field(default_factory=list)
    velocities_mps: list[Any] = field(default_factory=list)
    model_n: list[Any] = field(default_factory=list)
    ages_s: list[float] = field(default_factory=list)

    def feel(self, samples: Any) -> None:
        """Add samples felt by the hand (recarray of ``layout.SAMPLE``) if a liquid was present."""
        in_liquid = samples[samples["scene"] != 0]
        self.forces_n.append(in_liquid["device_force_n"])
        self.velocities_mps.append(in_liquid["velocity_mps"])
        if self.period_s is not None:
            self.model_n.append(in_liquid["force_n"])

    def see(self, painted_ns: int, view: TankView) -> None:
        """Add a frame that was seen."""
        self.ages_s.append((painted_ns - view.sample_time_ns) * 1e-9)

    def clear(self) -> None:
        """Discard all samples and frames."""
        for samples in (self.forces_n, self.velocities_mps, self.model_n, self.ages_s):
            samples.clear()

    def features(self) -> TrialFeatures:
        """Return the features from which a rating is computed."""
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
        """Return the delay of the sent force behind the model's force [s]."""
        if self.period_s is None or not self.model_n:
            return 0.0
        rows = lag(force_n, np.concatenate(self.model_n), round(LONGEST_S / self.period_s))
        return 0.0 if rows is None else max(rows * self.period_s, 0.0)


def exploration(draw: Draw, half_m: tuple[float, float, float], duration_s: float) -> tuple[Floats, Floats]:
    """Return times (n,) [s] and positions (n, 3) [m] of exploring ±``half_m`` for at least ``duration_s``."""
    reach_m = 0.7 * np.asarray(half_m)
    segments = [np.zeros((1, 3))]
    figures: list[_Figure] = []
    while sum(map(len, segments)) < duration_s * RATE_HZ:
        figures = figures or list(shuffle(_FIGURES, draw))
        segments += figures.pop()(draw, reach_m, segments[-1][-1])
        segments.append(np.tile(segments[-1][-1], (_row_count(_draw_uniform(draw, *_REST_S)), 1)))
    position_m = np.concatenate(segments)
    return np.arange(len(position_m)) / RATE_HZ, position_m


def _strokes(along: int, aside: int, sides: tuple[int, ...]) -> _Figure:
    """Return a figure that moves back and forth along one axis at random positions on another."""

    def figure(draw: Draw, reach_m: Floats, start_m: Floats) -> list[Floats]:
        ends_m = np.zeros((len(sides), 3))
        ends_m[:, along], ends_m[:, aside] = (
            np.array(sides) * reach_m[along],
            _draw_uniform(draw, -1, 1) * reach_m[aside] * 0.5,
        )
        return _path_through(draw, start_m, list(ends_m))

    return figure


def _zigzag(draw: Draw, reach_m: Floats, start_m: Floats) -> list[Floats]:
    """Return a path across the tank in legs that turn by about 90°."""
    across = np.linspace(-1, 1, 6) * reach_m[0]
    side = reach_m[2] * 0.5
    return _path_through(draw, start_m, [np.array([x, 0.0, side * (1 - 2 * (i % 2))]) for i, x in enumerate(across)])


def _circles(draw: Draw, reach_m: Floats, start_m: Floats) -> list[Floats]:
    """Return a stirring path: three circles about the centre at constant speed."""
    radius_m = min(reach_m[0], reach_m[2]) * _draw_uniform(draw, 0.6, 1.0)
    pace_mps = _draw_uniform(draw, *_PACE_MPS)
    first = np.array([radius_m, 0.0, 0.0])
    corners = np.empty(_CORNERS + 1, complex)
    corners[0] = 1.0
    for k in range(_CORNERS):
        corners[k + 1] = corners[k] * _TURN
    rows = _row_count(3 * 2 * np.pi * radius_m / pace_mps)
    corner = (np.arange(1, rows + 1) * (3 * _CORNERS / rows)) % _CORNERS
    x = np.interp(corner, np.arange(_CORNERS + 1), corners.real)
    z = np.interp(corner, np.arange(_CORNERS + 1), corners.imag)
    return [_stroke(start_m, first, pace_mps), radius_m * np.column_stack((x, np.zeros(rows), z))]


def _path_through(draw: Draw, start_m: Floats, places_m: list[Floats]) -> list[Floats]:
    """Return the path through positions, each stroke with its own speed."""
    return [
        _stroke(begin, end, _draw_uniform(draw, *_PACE_MPS))
        for begin, end in zip([start_m, *places_m[:-1]], places_m, strict=True)
    ]


def _stroke(begin_m: Floats, end_m: Floats, pace_mps: float) -> Floats:
    """Return the positions of a minimum-jerk stroke without its first point (Flash & Hogan 1985, eq. 10)."""
    displacement_m = end_m - begin_m
    rows = _row_count(float(np.sqrt((displacement_m * displacement_m).sum())) / pace_mps)
    progress = np.arange(1, rows + 1) / rows
    fraction = progress * progress * progress * (10.0 + progress * (6.0 * progress - 15.0))
    return np.asarray(begin_m + fraction[:, None] * displacement_m)


_FIGURES: tuple[_Figure, ...] = (
    _strokes(0, 1, (1, -1, 1, -1)),
    _circles,
    _zigzag,
    _strokes(1, 0, (1, -1, 1)),
    _strokes(2, 0, (1, -1, 1)),
)


def _row_count(duration_s: float) -> int:
    return max(1, round(duration_s * RATE_HZ))


def _draw_uniform(draw: Draw, low: float, high: float) -> float:
    return low + (high - low) * draw()


def reading_s(page: TextPage) -> float:
    """Return the time that it takes to read a page [s]."""
    return 1.0 + _SECONDS_PER_WORD * sum(len(paragraph.split()) for paragraph in (page.title, *page.paragraphs))


class Explorer:
    """Explore for a preferred time, then press the space bar to continue."""

    def __init__(self, task: Task, device: HandOrders, draw: Draw, now_s: float) -> None:
        least_s = task.limit_s if task.least_s is None else task.least_s
        stay_s = least_s + (0.1 + 0.2 * draw()) * max(least_s, 5.0)
        self._leave_s = math.inf if task.least_s is None else now_s + min(stay_s, task.limit_s)
        device.follow(*exploration(draw, device.workspace_m, stay_s))

    def act(self, now_s: float, _view: TankView) -> bool:
        """Return whether the space bar is pressed."""
        return now_s >= self._leave_s


class Reacher:
    """Reach for the lit target, and try again if the ball is seen at rest outside it."""

    def __init__(self, task: Reach, device: HandOrders, draw: Draw, _now_s: float) -> None:
        self._task = task
        self._device = device
        self._draw = draw
        self._seen: int | None = None
        self._move_s = 0.0
        self._outside_since_s: float | None = None

    def act(self, now_s: float, view: TankView) -> bool:
        """Move the hand in response to the view; return False, since the space bar is never pressed."""
        lit = view.task.lit
        if lit is None:
            return False
        if lit != self._seen:
            self._seen = lit
            self._move_s = now_s + _draw_uniform(self._draw, *_REACTION_S)
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
        elif now_s - self._outside_since_s >= _CORRECTION_S:
            self._outside_since_s = None
            self._reach_for(lit)

    def _reach_for(self, target: int) -> None:
        self._move_s = 0.0
        error_m = _AIM_ERROR * self._task.radius_m
        x, y, z = (
            coordinate_m + error_m * _draw_uniform(self._draw, -1, 1) for coordinate_m in self._task.targets_m[target]
        )
        self._device.reach_to(x, y, z)


class Follower:
    """Follow the moving target without a lag, since its swing is regular, but with an error of aim."""

    def __init__(self, task: Task, device: HandOrders, draw: Draw, _now_s: float) -> None:
        t_s = np.arange(round(task.limit_s * _PATH_RATE_HZ) + 1) / _PATH_RATE_HZ
        error_m = _AIM_ERROR * task.radius_m
        path_m = _target_path(task, t_s)
        path_m += (
            np.array([error_m * _draw_uniform(draw, -1, 1) for _ in range(3)]) * np.minimum(t_s, 1.0)[:, np.newaxis]
        )
        device.follow(t_s, path_m)

    def act(self, _now_s: float, _view: TankView) -> bool:
        """Return False: the space bar is not pressed, since time ends the task."""
        return False


class Hand(Protocol):
    """A simulated participant's behaviour in a task."""

    def act(self, now_s: float, view: TankView, /) -> bool:
        """Move the hand in response to the view; return whether the space bar is pressed."""
        ...


def hand_behaviour(task: Task, device: HandOrders, draw: Draw, now_s: float) -> Hand:
    """Return the behaviour for a task with a simulated hand, from ``now_s`` on [s]."""
    behaviour: Hand = resolve_name(task.hand)(task, device, draw, now_s)
    return behaviour


def _target_path(task: Task, times_s: Floats) -> Floats:
    """Return the positions (n, 3) [m, hand frame] of the moving target at times (n,) [s]."""
    return np.array([task.target_m(float(time_s)) for time_s in times_s])


def rest_hand(task: Task, device: HandOrders) -> None:
    """Move a simulated hand after a task to the start of the next interval: a fixed position, or the middle.

    Otherwise the hand would jump there when the next trial begins, with forces that a person would not feel.
    """
    if task.start_m is not None:
        device.reach_to(*task.start_m)
    else:
        device.reach_to(0.0, 0.0, 0.0, _RETURN_S)


@dataclass(frozen=True, slots=True)
class Choice:
    """The choice of ``value`` for ``item``, ``after_s`` after the previous choice."""

    item: str
    value: Value
    after_s: float


def fill_in_page(page: QuestionnairePage, features: TrialFeatures, person: Rater, draw: Draw) -> list[Choice]:
    """Return the choices that answer a page, from the features of the trial."""
    judgement_by_item = judgements([item.id for item in page.items], features, person, draw)
    answers = {item.id: item.simulated(judgement_by_item[item.id], draw) for item in page.items}
    visible = shown_questions(page.items, answers)
    return answer_choices([item for item in page.items if item.id in visible], answers, draw)


def answer_choices(
    items: Iterable[ItemView], answers: Mapping[str, Value], draw: Draw, *, changes_mind: bool = True
) -> list[Choice]:
    """Return the choices that lead to ``answers``, in order; some first choose a neighbouring value."""
    choices: list[Choice] = []
    for item in items:
        value = answers[item.id]
        if changes_mind and draw() < _REVISION_PROBABILITY and (first_value := item.nearby(value)) != value:
            choices.append(Choice(item.id, first_value, _draw_uniform(draw, *ANSWER_S)))
        choices.append(Choice(item.id, value, _draw_uniform(draw, *ANSWER_S)))
    return choices


def newly_shown_questions(
    page: QuestionnairePage | DesignPage, answers: Mapping[str, Value], seen: Collection[str]
) -> tuple[str, ...]:
    """Return the questions of a page that appear because of the answers so far."""
    return tuple(item for item in shown_questions(page.items, answers) if item not in seen)


def _mean(values: Any) -> float:
    return float(values.mean()) if len(values) else 0.0


def _norm(vectors: Any) -> Any:
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))


class ProgrammedBall:
    """A ball that repeats a path of ``duration_s`` [s] through a task in a tank of these full sizes [m].

    With ``hidden_after_lead`` it is not drawn once the task's lead-in is over; ``seed`` is used for an exploration.
    """

    def __init__(
        self, task: Task, workspace_m: tuple[float, float, float], *, hidden_after_lead: bool = False, seed: int = 1
    ) -> None:
        self._task, self._hides = task, hidden_after_lead
        times_s, self._positions_m = task_path(
            task, workspace_m, min(_LONGEST_PATH_S, task.limit_s - _BEFORE_END_S), seed
        )
        self.duration_s = float(times_s[-1])
        self._times_ns = np.round(times_s * 1e9).astype(np.int64)
        samples = np.zeros(len(times_s), _SAMPLE)
        samples["time_ns"], samples["position_m"] = self._times_ns, self._positions_m
        self._tracker = new_tracker(task)
        self._tracker.feed(samples)

    def view(self, elapsed_s: float) -> TankView:
        """Return the view of the tank ``elapsed_s`` after the ball began to move [s]."""
        now_ns = round(elapsed_s % self.duration_s * 1e9)
        position_m = np.array([np.interp(now_ns, self._times_ns, axis) for axis in self._positions_m.T])
        task_view = self._tracker.at(now_ns)
        return TankView(position_m, task_view, now_ns, self._hides and task_view.elapsed_s >= self._task.judged_from_s)


def task_path(
    task: Task, workspace_m: tuple[float, float, float], duration_s: float, seed: int
) -> tuple[Floats, Floats]:
    """Return times (n,) [s] and positions (n, 3) [m, hand frame] of a path of about ``duration_s``."""
    if isinstance(task, Reach):
        return _reaching_path(task, duration_s)
    if task.paced:
        times_s = np.arange(0.0, duration_s, 1 / RATE_HZ)
        return times_s, _target_path(task, times_s)
    x, y, z = (size / 2 for size in workspace_m)
    times_s, positions_m = exploration(stream(seed, "preview/hand").random, (x, y, z), duration_s)
    in_time = times_s <= duration_s
    return times_s[in_time], positions_m[in_time]


def _reaching_path(task: Reach, duration_s: float) -> tuple[Floats, Floats]:
    """Return minimum-jerk movements from target to target (Flash & Hogan 1985), with a stay at each."""
    leg_s = _MOVE_S + task.dwell_s + _STAY_S
    leg_count = max(1, min(int(duration_s / leg_s), task.count or int(duration_s / leg_s)))
    ends_m = np.array([(0.0, 0.0, 0.0), *(task.targets_m[leg % len(task.targets_m)] for leg in range(leg_count))])
    times_s = np.arange(0.0, min(leg_count * leg_s, duration_s), 1 / RATE_HZ)
    leg = np.minimum((times_s / leg_s).astype(int), leg_count - 1)
    progress = np.clip((times_s - leg * leg_s) / _MOVE_S, 0.0, 1.0)
    fraction = progress**3 * (10 - 15 * progress + 6 * progress**2)
    return times_s, ends_m[leg] + fraction[:, None] * (ends_m[leg + 1] - ends_m[leg])
