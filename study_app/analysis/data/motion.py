"""Measures of movement and force: over whole trials, and for reaches from one target to the next.

Times and positions are those of the device, without the delay, as when the session decided that a target was reached.

Measures of trials are in the tables of trials; those of reaches are computed from the recordings that were stored. The
first reach of a trial is left out, because it begins wherever the hand happens to be.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from study_app.analysis.data.blocks import Block
from study_app.analysis.data.measures import Array, quartiles_or_none
from study_app.analysis.data.study_tables import Study
from study_app.errors import StoreError
from study_app.haptics.model.layout import LIMITER_GLITCH
from study_app.store.merged import session_in
from study_app.store.recordings import SealedRecording, read_samples

_CUTOFF_HZ: Final = 10.0
"""Voluntary movement is slower than this; speeds are low-pass filtered (zero-phase Butterworth, total order 4)."""

_PROMINENCE: Final = 0.1
"""A peak of speed is a submovement if its prominence is at least this proportion of the reach's highest speed."""

_SHORTEST: Final = 32
"""The fewest samples that can be filtered; a shorter reach counts as one submovement."""

REACH_DEFINITIONS: Final = {
    "movement_time_s": "from the moment a target lights up until the hand enters it for the last time, excluding the "
    "dwell time",
    "path_mm": "length of the hand's path during the movement time",
    "overshoot_mm": "largest distance that the hand travelled beyond the far edge of the target, along the line "
    "between the targets; "
    "0 if there was no overshoot",
    "submovements": f"number of peaks in the hand's speed (low-pass filtered at {_CUTOFF_HZ:g} Hz) before the target "
    f"was reached, with a prominence of at least {100 * _PROMINENCE:g} % of the highest peak; 1 for a single smooth "
    "movement",
}


@dataclass(frozen=True, slots=True)
class Targets:
    """The targets of a reaching task: ``centres_m`` (targets, 3) in the hand frame, radius and dwell time."""

    centres_m: Array
    radius_m: float
    dwell_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Reach:
    """One reach: its ``target``, when the target was lit and when it was reached [s, from the trial's first sample]."""

    target: int
    lit_s: float
    reached_s: float
    movement_time_s: float
    path_mm: float
    overshoot_mm: float
    submovements: int


def reaches(times_ns: NDArray[np.int64], positions_m: Array, targets: Targets) -> tuple[Reach, ...]:
    """Return the completed reaches of a trial from times (n,) and hand positions (n, 3)."""
    seconds = (times_ns - times_ns[0]) / 1e9 if len(times_ns) else np.zeros(0)
    movements = []
    for number, samples in enumerate(_target_samples(times_ns, positions_m, targets)):
        lit, entered, reached = samples.lit, samples.entered, samples.reached
        target = number % len(targets.centres_m)
        path_m = positions_m[lit : entered + 1]
        movements.append(
            Reach(
                target=target,
                lit_s=round(float(seconds[lit]), 9),
                reached_s=round(float(seconds[reached]), 9),
                movement_time_s=round(float(seconds[entered] - seconds[lit]), 9),
                path_mm=1000 * path_length_m(path_m),
                overshoot_mm=1000 * _overshoot_m(positions_m[lit : reached + 1], targets, target),
                submovements=submovements(seconds[lit : reached + 1], positions_m[lit : reached + 1]),
            )
        )
    return tuple(movements)


class _ReachSamples(NamedTuple):
    """The samples at which a target was lit, entered for the last time, and reached."""

    lit: int
    entered: int
    reached: int


def _target_samples(times_ns: NDArray[np.int64], positions_m: Array, targets: Targets) -> Iterator[_ReachSamples]:
    """Yield the samples of each completed reach, in order."""
    dwell_ns = round(targets.dwell_s * 1e9)
    lit = number = 0
    while lit < len(times_ns):
        centre = targets.centres_m[number % len(targets.centres_m)]
        first = lit if number == 0 else lit + 1  # a target is entered after the sample that lit it
        inside = ((positions_m[first:] - centre) ** 2).sum(axis=1) <= targets.radius_m**2
        edges = np.flatnonzero(np.diff(inside, prepend=False, append=False)) + first
        for entered, left in zip(edges[::2], edges[1::2], strict=True):
            reached = int(np.searchsorted(times_ns, times_ns[entered] + dwell_ns))
            if reached < left:
                yield _ReachSamples(lit=lit, entered=int(entered), reached=reached)
                lit, number = reached, number + 1
                break
        else:
            return


def path_length_m(positions_m: Array) -> float:
    """Return the length of a path (n, 3) [m]."""
    return float(np.linalg.norm(np.diff(positions_m, axis=0), axis=1).sum())


def submovements(seconds: Array, positions_m: Array) -> int:
    """Return the number of speed peaks along a path (n, 3) at ``seconds`` (n,); at least 1."""
    from scipy.signal import filtfilt, find_peaks  # noqa: PLC0415 - takes 0.2 s to import, and is only needed with targets

    if len(seconds) < _SHORTEST:
        return 1
    rate_hz = (len(seconds) - 1) / (seconds[-1] - seconds[0])
    if rate_hz <= 2 * _CUTOFF_HZ:
        return 1
    speed = np.linalg.norm(np.gradient(positions_m, seconds, axis=0), axis=1)
    smooth = filtfilt(*_low_pass(rate_hz), speed)
    peaks, _ = find_peaks(smooth, prominence=_PROMINENCE * float(smooth.max()))
    return max(1, len(peaks))


def _low_pass(rate_hz: float) -> tuple[Array, Array]:
    """Return ``scipy.signal.butter(2, _CUTOFF_HZ, fs=rate_hz)``; scipy's general design takes longer than filtering."""
    warped = math.tan(math.pi * _CUTOFF_HZ / rate_hz)
    damped, square = math.sqrt(2) * warped, warped**2
    scale = 1 / (1 + damped + square)
    below = scale * np.array([square, 2 * square, square])
    return below, np.array([1.0, 2 * scale * (square - 1), scale * (1 - damped + square)])


def _overshoot_m(path_m: Array, targets: Targets, target: int) -> float:
    """Return how far a path went beyond the far edge of its target [m], as seen from the previous target."""
    line = targets.centres_m[target] - targets.centres_m[target - 1]
    length = float(np.linalg.norm(line))
    if length == 0.0:
        return 0.0
    beyond = (path_m - targets.centres_m[target]) @ (line / length)
    return max(0.0, float(beyond.max()) - targets.radius_m)


OF_TRIALS: Final = ("duration_s", "path_m", "force_mean_n", "force_peak_n", "at_limit_percent")
OF_REACHES: Final = ("movement_time_s", "path_mm", "overshoot_mm", "submovements")
TRIAL_DEFINITIONS: Final = {
    "duration_s": "from the start of the trial to its end",
    "path_m": "length of the hand's path during the trial",
    "force_mean_n": "mean force on the hand during the trial",
    "force_peak_n": "largest force on the hand during the trial",
    "at_limit_percent": "proportion of the trial's servo ticks in which the force was clipped at the force limit",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class MovementQuartiles:
    """One movement measure in one setting: the quartiles of ``n`` participants' medians."""

    block: str
    code: str
    measure: str
    n: int
    median: float | None
    q1: float | None
    q3: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialReaches:
    """The reaches of one valid trial, without the first."""

    participant: str
    session: int
    trial: int
    block: str
    code: str
    valid: bool | None
    found: tuple[Reach, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Performance:
    """All movement measures; ``reaching`` are the IDs of the blocks with a reaching task.

    Of the valid ``trials`` in these blocks, ``recorded`` have a readable recording; ``unread`` has one line for each
    reason why others have none. For ``judged`` trials it is known whether they met the protocol's limits; ``invalid``
    trials did not, but the measures include them.
    """

    moved: tuple[MovementQuartiles, ...]
    reaching: tuple[str, ...]
    reached: tuple[TrialReaches, ...]
    trials: int
    recorded: int
    judged: int
    invalid: int
    unread: tuple[str, ...]

    def medians(self, block: str) -> pd.DataFrame:
        """Return each participant's median of every reaching measure, by (code, participant)."""
        return _participant_medians(_reach_table(self.reached), block, OF_REACHES)

    def recorded_in(self, block: str) -> bool:
        """Return whether a block has any reaches."""
        return any(trial.block == block for trial in self.reached)


def performance(study: Study, each: Callable[[int, int], object] = lambda _done, _of: None) -> Performance:
    """Measure the valid trials; ``each`` is called with the number of recordings read and the total."""
    rows = study.trials[study.trials["counted"]]
    tasks = {block.id: _targets(study.protocol, block) for block in study.trial_blocks}
    reaching_blocks = tuple(name for name, targets in tasks.items() if targets is not None)
    reaching = rows[rows["block"].isin(reaching_blocks)]
    trial_reaches: list[TrialReaches] = []
    unread: dict[str, int] = {}
    for number, row in enumerate(reaching.to_dict("records")):
        each(number, len(reaching))
        targets = tasks[str(row["block"])]
        reached = (
            _explain_missing_recording(study.folder, row)
            if targets is None
            else _read_reaches(study.folder, row, targets)
        )
        if isinstance(reached, str):
            unread[reached] = unread.get(reached, 0) + 1
        else:
            trial_reaches.append(reached)
    of_trials = rows.assign(
        path_m=rows["path_length_m"],
        at_limit_percent=100 * rows["limiter_norm"].astype("Float64") / rows["ticks"].replace(0, pd.NA),
    )
    moved = [quartile for block in study.trial_blocks for quartile in _movement_quartiles(block, of_trials, OF_TRIALS)]
    if trial_reaches:
        of_reaches = _reach_table(trial_reaches)
        moved += [
            quartile
            for block in study.trial_blocks
            if block.id in reaching_blocks
            for quartile in _movement_quartiles(block, of_reaches, OF_REACHES)
        ]
    return Performance(
        moved=tuple(moved),
        reaching=reaching_blocks,
        reached=tuple(trial_reaches),
        trials=len(reaching),
        recorded=len(trial_reaches),
        judged=int(rows["valid"].notna().sum()),
        invalid=int((~rows["valid"].fillna(value=True)).sum()),
        unread=tuple(f"{count} × {reason}" for reason, count in unread.items()),
    )


def _reach_table(reached: Iterable[TrialReaches]) -> pd.DataFrame:
    """Return one row per reach, with the trial's participant, block and code."""
    of_trial, of_reach = attrgetter("participant", "block", "code"), attrgetter(*OF_REACHES)
    rows = [(*of_trial(trial), *of_reach(reach)) for trial in reached for reach in trial.found]
    return pd.DataFrame(rows, columns=["participant", "block", "code", *OF_REACHES])


def _targets(protocol: Mapping[str, Any], block: Block) -> Targets | None:
    """Return the targets of a block's task, None if it has none."""
    name = protocol.get("blocks", {}).get(block.id, {}).get("task")
    task = protocol.get("tasks", {}).get(name, {})
    if task.get("kind") != "reach":
        return None
    return Targets(np.asarray(task["targets_mm"], dtype=float) / 1000, task["radius_mm"] / 1000, task["dwell_s"])


def _read_reaches(folder: Path, row: Mapping[Any, Any], targets: Targets) -> TrialReaches | str:
    """Return the reaches of a trial, or the reason why they are unknown."""
    if reason := _explain_missing_recording(folder, row):
        return reason
    try:
        samples = read_samples(_recording_path(folder, row))
    except SealedRecording:
        return "the recording is sealed (liquid-study unblind unseals it)"
    except StoreError:
        return "a recording is damaged (liquid-study verify shows which one)"
    is_valid = (samples["scene"] == samples["scene"][-1:]) & (samples["limiters"] & LIMITER_GLITCH == 0)
    times_ns, positions_m = samples["time_ns"][is_valid], samples["position_m"][is_valid]
    is_during = times_ns <= times_ns[:1] + round(float(row["duration_s"]) * 1e9)
    return TrialReaches(
        participant=str(row["participant"]),
        session=int(row["session"]),
        trial=int(row["trial"]),
        block=str(row["block"]),
        code=str(row["code"]),
        valid=None if pd.isna(row["valid"]) else bool(row["valid"]),
        found=reaches(times_ns[is_during], positions_m[is_during], targets)[1:],
    )


def _explain_missing_recording(folder: Path, row: Mapping[Any, Any]) -> str:
    if pd.isna(row["recording"]):
        return "no recording was stored"
    if pd.isna(row["duration_s"]):
        return "the trial's duration was not recorded"
    return "" if _recording_path(folder, row).is_file() else "the recording is missing from the folder"


def _recording_path(folder: Path, row: Mapping[Any, Any]) -> Path:
    return session_in(folder, str(row["participant"]), int(row["session"])).path / str(row["recording"])


def _participant_medians(rows: pd.DataFrame, block: str, measures: Sequence[str]) -> pd.DataFrame:
    return rows[rows["block"] == block].groupby(["code", "participant"])[list(measures)].median()


def _movement_quartiles(block: Block, rows: pd.DataFrame, measures: Sequence[str]) -> Iterator[MovementQuartiles]:
    """Yield the quartiles of the participants' medians, by measure and setting."""
    medians = _participant_medians(rows, block.id, measures)
    for measure in measures:
        for code in block.codes:
            values = medians[measure][medians.index.get_level_values("code") == code].dropna().to_numpy(dtype=float)
            yield MovementQuartiles(
                block=block.id, code=code, measure=measure, n=len(values), **quartiles_or_none(values)._asdict()
            )
