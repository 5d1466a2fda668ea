"""Replay of a session: recompute every recorded force and delivered value, and compare them with the recorded ones.

Forces are recomputed from the recorded times and positions with the same code as in the session. Recordings contain the
CRC-32 of each second of exact forces. With the version of the force rules in the receipt, the same kind of processor
gives the same bits; seconds that differ are listed. The delivered values of each interval are compared with the
journal.

The key is opened only in memory and not printed, so that the user who replays a session stays blind.

A recording begins shortly before its trial, so that its initial force is known, or continues the previous recording if
there was no pause between them. Parts that cannot be recomputed are listed, since they are not verified.
"""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from study_app.errors import StoreError, StudyError
from study_app.haptics.kernels import START_FADE_S, new_safety
from study_app.haptics.model.device_dynamics import Dynamics, dynamics_from
from study_app.haptics.model.force_rules import ForceRules, rules_from
from study_app.haptics.model.layout import LIMITER_FADE, LIMITER_GLITCH, SAMPLE, records
from study_app.haptics.model.scene import FADE_S, Scene
from study_app.haptics.runtime.offline import law_along, recompute_scenes
from study_app.haptics.runtime.pack import adjust_into, pack
from study_app.protocol.model import Protocol
from study_app.protocol.presented import link_seed, recorded_presentation
from study_app.protocol.trials import Stimulated
from study_app.store import receipt, recordings
from study_app.store.blinded import Key, complete_protocol, open_events, protocol_errors, read_key, recorded_protocol
from study_app.store.files import is_there, locate_session
from study_app.store.journals import journal
from study_app.store.journals import journal_events as events
from study_app.store.session_progress import Delivered, attempt_name, delivered_error, delivered_values, judged_fields

_TOLERANCE: Final = 1e-9


def _scene_presented(
    protocol: Protocol, key: Key, started: events.TrialStarted, interval: int | None, link_seed: int
) -> Scene:
    """Return the presented scene of a condition, or of an interval of a trial whose line was opened.

    ``link_seed`` seeds the jitter and loss of the force.
    """
    if interval is None:
        return protocol.presented_scene(Stimulated(key.condition(started.block, started.code)), link_seed)
    due = recorded_presentation(protocol, key.codes, started.fields())
    return protocol.presented_scene(due.intervals[interval - 1], link_seed)


@dataclass(frozen=True, slots=True)
class Step:
    """One step of an adjustment: the number of its scene in telemetry, and the scene."""

    serial: int
    scene: Scene


def _steps_of(
    protocol: Protocol, key: Key, started: events.TrialStarted, interval: int | None, lines: Sequence[events.Event]
) -> tuple[Step, ...]:
    """Return the steps of an adjusted interval that change a force, in order; empty for other intervals.

    ``started`` is the opened line of the trial's start, ``interval`` is None in a trial without intervals, and
    ``lines`` are those of the session's journal.
    """
    if interval is None or started.level is None or interval != len(started.arrangement or ""):
        return ()
    presented = recorded_presentation(protocol, key.codes, started.fields()).intervals[interval - 1]
    line_steps = [line for line in lines if isinstance(line, events.Stepped) and line.which == started.which]
    setting = protocol.adjusting(protocol.blocks[started.block], started.standard, started.level)
    if setting is None:
        return ()
    level_index, steps = 0, []
    for line in line_steps:
        level_index = setting.moved(level_index, line.steps)
        if line.scene is not None:
            steps.append(
                Step(line.scene, protocol.presented_scene(replace(presented, value=setting.comparison(level_index))))
            )
    return tuple(steps)


def _with_last_scene_number(samples: Any, steps: Sequence[Step]) -> Any:
    """Return the samples (n,) with all scene numbers of an adjusted interval replaced by the last one."""
    if not steps or len(samples) == 0:
        return samples
    renumbered = samples.copy()
    renumbered.scene[samples.scene >= steps[0].serial - 1] = samples.scene[-1]
    return renumbered


def _step_starts(samples: Any, steps: Sequence[Step]) -> list[tuple[int, Scene]]:
    """Return the index of the first sample and the scene of each step, without steps that have no sample."""
    starts = ((np.flatnonzero(samples.scene >= step.serial), step.scene) for step in steps)
    return [(int(indices[0]), scene) for indices, scene in starts if indices.size]


def _interval_samples(samples: Any, duration_s: float) -> Any:
    """Return the samples of an interval's task from its recording, which begins earlier and ends later.

    ``duration_s`` is the duration of the task in the journal.
    """
    task_samples = samples[samples["scene"] == samples["scene"][-1]]
    valid = task_samples[task_samples["limiters"] & LIMITER_GLITCH == 0]
    until_ns = valid["time_ns"][:1] + round(duration_s * 1e9)
    return task_samples[task_samples["time_ns"] <= until_ns]


def _recompute_delivered(
    protocol: Protocol,
    presented: Stimulated,
    started: events.TrialStarted,
    interval: int,
    samples: Any,
    measured: Mapping[str, Any],
) -> Delivered:
    """Recompute the delivered values of an interval from the samples of its recording.

    ``started`` is the opened line of the trial's start, ``measured`` holds the measures in the line of the interval's
    end.
    """
    block = protocol.blocks[started.block]
    adjusted = protocol.design_of(block).adjusts and interval == len(started.arrangement or "")
    task_samples = judged_fields(_interval_samples(samples, measured["duration_s"]))
    return delivered_values(protocol, presented, protocol.tasks[block.task], task_samples, adjusted=adjusted)


def recompute_force_error(scene: Scene, rate_hz: float, samples: Any, ended: Mapping[str, Any]) -> float | None:
    """Recompute the force error of a trial or interval from its recording and the opened line of its end."""
    task_samples = judged_fields(_interval_samples(samples, ended["duration_s"]))
    return delivered_error(task_samples, rate_hz, scene.fade_s, partial(law_along, scene))


def differing_columns(recomputed: Mapping[str, float | None], ended: Mapping[str, Any]) -> Iterator[str]:
    """Yield the columns that the journal has with other values than the recomputed ones."""
    for name, value in recomputed.items():
        if name in ended and not _is_close(value, ended[name]):
            yield name


def _is_close(value: float | None, other: float | None) -> bool:
    if value is None or other is None:
        return value is other
    return bool(np.isclose(value, other, rtol=_TOLERANCE, atol=_TOLERANCE))


_MAX_LISTED_SECONDS = 8
_FORCES = ("force_n", "command_n", "device_force_n")
_ROUNDING = 1e-9
_FLOAT32 = 2.0**-23  # relative precision of recorded float32 values


@dataclass(slots=True, kw_only=True)
class Replayed:
    """The result of a replay.

    ``recordings`` and ``seconds`` count what was compared. ``differences`` has a sentence for each recording with
    different forces, ``missing`` one for each recording in the journal whose file is missing, ``uncompared`` one for
    each that could not be recomputed completely. ``lasted_s`` is the duration of the recorded motion, ``computed_s``
    that of the recomputation; ``took_s`` includes reading the files and loading the code.
    """

    recordings: int = 0
    seconds: int = 0
    lasted_s: float = 0.0
    computed_s: float = 0.0
    took_s: float = 0.0
    differences: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    uncompared: tuple[str, ...] = ()

    @property
    def proved(self) -> bool:
        """Whether data were compared, all are equal, and no recording is missing."""
        return self.seconds > 0 and not self.differences and not self.missing


def replay(session_folder: Path) -> Replayed:
    """Recompute every recorded force of a session and compare it with the recorded one.

    Raises
    ------
    StoreError
        It is not a session folder, or its journal, receipt, key or a recording cannot be read.

    Examples
    --------
    >>> from tempfile import mkdtemp
    >>> from study_app.session.simulated.rehearsal import rehearse
    >>> study = rehearse("demo", participants=1, seed=1, results=Path(mkdtemp(), "demo"))
    >>> result = replay(study / "data" / "sub-P001" / "ses-01")
    >>> result.recordings, result.differences, result.proved
    (4, (), True)
    """
    began = time.perf_counter()
    study, session = locate_session(session_folder)
    session_receipt = receipt.read(session.receipt)
    key = read_key(study.path)
    if key.hash != session_receipt["key_hash"]:
        raise StoreError(f"{study.key} is not the key for session {session.path}: restore it from a backup")
    lines = open_events(journal.read(session.journal), key)
    protocol, devices, (drawn_from, participant) = _recorded_setup(session.receipt, session_receipt, key, lines)
    _recompute_forces(records(SAMPLE, 0), Scene(), devices[None], None)  # loads the compiled code before the timing
    replayed = Replayed()
    ends = {line.which: line for line in lines if isinstance(line, events.TrialEnded | events.IntervalEnded)}
    previous: _Recomputed | None = None
    resumed_at: str | None = None
    for started, which, line, resumed in _recorded_presentations(lines):
        if resumed != resumed_at:  # the servo was restarted: nothing continues from the previous recording
            previous, resumed_at = None, resumed
        if resumed not in devices:
            raise StoreError(
                f"{session.receipt} does not state which device has been used since {resumed}: restore it from a backup"
            )
        name = attempt_name(*which)
        if not isinstance(line, events.Recorded):
            reason = "the journal does not say why" if line is None else line.reason
            replayed.uncompared += (f"{name}: the recording is missing ({reason})",)
            continue
        path = session.path / line.recording
        if not is_there(path):
            replayed.missing += (f"{name}: {line.recording} is missing, although the journal lists it",)
            continue
        seed = link_seed(drawn_from, participant, *which)
        interval = which[-1]
        scene = _scene_presented(protocol, key, started, interval, seed)
        steps = _steps_of(protocol, key, started, interval, lines)
        recorded, checks = recordings.read_samples(path, key.nonce), recordings.read_checks(path, key.nonce)
        compute_start = time.perf_counter()
        samples = _with_last_scene_number(recorded, steps)
        try:
            previous = _recompute_forces(samples, scene, devices[resumed], previous, _step_starts(recorded, steps))
        except StudyError as error:
            previous = None
            replayed.uncompared += (f"{name}: not recomputable: {error}",)
            continue
        _compare_recording(replayed, name, samples, previous, checks)
        if (ended := ends.get(which)) is not None and _samples_before_gap(samples.tick) == len(samples):
            recomputed: dict[str, float | None] = {}
            measured = ended.others
            if interval is not None:
                presented = recorded_presentation(protocol, key.codes, started.fields()).intervals[interval - 1]
                recomputed |= _recompute_delivered(protocol, presented, started, interval, samples, measured).columns
            if measured.get("delivered_error") is not None and ended.outcome != "interrupted":
                recomputed["delivered_error"] = recompute_force_error(scene, protocol.device.rate_hz, samples, measured)
            replayed.differences += tuple(
                f"{name}: the column {column} differs" for column in differing_columns(recomputed, measured)
            )
        replayed.computed_s += time.perf_counter() - compute_start
    replayed.took_s = time.perf_counter() - began
    return replayed


class _Device(NamedTuple):
    """A device as recorded in a receipt, with the rules by which its forces were computed."""

    limit_n: float
    dynamics: Dynamics
    rules: ForceRules


@dataclass(slots=True, kw_only=True)
class _Recomputed:
    """A recomputed recording and the final state of its models, from which the next recording may continue.

    ``knows_its_start`` is True if the recording began without a force, or continues one for which it is True.
    """

    serial: int
    model: Any
    safety: Any
    samples: Any
    knows_its_start: bool = True


def _recompute_forces(
    samples: Any, scene: Scene, device: _Device, previous: _Recomputed | None, steps: Sequence[tuple[int, Scene]] = ()
) -> _Recomputed:
    """Recompute the forces in a copy of ``samples``, whose trial has the scene number of the last sample.

    ``steps`` are the samples from which the scene has other parameters, with the changed scene.
    """
    recomputed = samples.copy()
    serial = int(recomputed.scene[-1]) if len(recomputed) else 0
    limit_n, dynamics, rules = device
    at_rest = pack(scene.model_copy(update={"liquids": (), "fade_s": FADE_S}), dynamics=dynamics, rules=rules)
    model = pack(scene, dynamics=dynamics, rules=rules)
    first = 0
    shared_rows = _shared_samples(previous, recomputed)
    if previous is not None and shared_rows is not None:
        first = shared_rows
        _copy_forces(previous.samples[len(previous.samples) - first :], recomputed[:first])
        _run_steps(
            (at_rest, previous.model, model),
            (previous.serial, serial),
            previous.safety[0],
            recomputed,
            first,
            steps,
            device,
        )
        return _Recomputed(
            serial=serial,
            model=model,
            safety=previous.safety,
            samples=recomputed,
            knows_its_start=previous.knows_its_start,
        )
    safety = new_safety(limit_n)
    if len(recomputed) and recomputed.tick[0] != 0:
        _set_safety_state(safety[0], recomputed)
        first = 1
    knows_its_start = not recomputed.force_n[recomputed.scene != serial].any()
    _run_steps((at_rest, at_rest, model), (0, serial), safety[0], recomputed, first, steps, device)
    return _Recomputed(serial=serial, model=model, safety=safety, samples=recomputed, knows_its_start=knows_its_start)


def _shared_samples(previous: _Recomputed | None, samples: Any) -> int | None:
    """Return the number of samples shared with the previous recording; None if this one does not continue it."""
    if previous is None or len(samples) == 0 or len(previous.samples) == 0:
        return None
    shared_rows = int(previous.samples.tick[-1] + 1 - samples.tick[0])
    return shared_rows if 0 <= shared_rows <= min(len(samples), len(previous.samples)) else None


def _copy_forces(source: Any, samples: Any) -> None:
    for name in ("velocity_mps", "wake_mps", "force_n", "command_n", "device_force_n", "limiters", "status"):
        samples[name] = source[name]


def _set_safety_state(safety: Any, samples: Any) -> None:
    """Set the state of the safety layer to that of the first sample, which is recorded exactly.

    Only the duration of a running fade matters, because the trial's own scene restarts the fade, and no force is felt
    before it. The fade of the session's start is over if a sample before the next scene shows no fade.
    """
    later = np.flatnonzero(samples.scene != samples.scene[0])
    lead = samples[: later[0]] if later.size else samples[:1]
    fades = bool((lead.limiters & LIMITER_FADE).all())
    safety.started = 1
    safety.tick_ns = safety.usable_ns = samples.time_ns[0]
    safety.fade = 0.0 if fades else 1.0
    safety.fade_s = START_FADE_S if fades else 0.0
    safety.slewed_n[:] = samples.command_n[0]


def _run_steps(
    models: tuple[Any, Any, Any],
    serials: tuple[int, int],
    safety: Any,
    samples: Any,
    first: int,
    steps: Sequence[tuple[int, Scene]],
    device: _Device,
) -> None:
    """Run the models over ``samples`` from ``first`` onwards, changing the scene's parameters at each step."""
    for step_row, scene in steps:
        recompute_scenes(*models, *serials, safety, samples[:step_row], first)
        adjust_into(models[-1], scene, dynamics=device.dynamics, rules=device.rules)
        first = max(first, step_row)
    recompute_scenes(*models, *serials, safety, samples, first)


def _compare_recording(
    replayed: Replayed, name: str, samples: Any, recomputed: _Recomputed, checks: recordings.Checks
) -> None:
    """Compare one recording's checks with those of the recomputed forces."""
    if len(samples) == 0:
        replayed.uncompared += (f"{name}: the recording is empty",)
        return
    if not recomputed.knows_its_start:
        replayed.uncompared += (f"{name}: the recording continues an earlier one, which is missing or has a gap",)
        return
    replayed.recordings += 1
    replayed.lasted_s += float(samples.time_ns[-1] - samples.time_ns[0]) * 1e-9
    complete_rows = _samples_before_gap(samples.tick)
    if complete_rows < len(samples):
        lost_s = complete_rows / checks.rows
        replayed.uncompared += (f"{name}: samples are missing after {lost_s:.1f} s; the rest was not compared",)
    replayed.seconds += sum(
        min((second + 1) * checks.rows, len(samples)) <= complete_rows for second in range(len(checks.device_force))
    )
    differing = _seconds_with_other_crcs(checks, recomputed.samples) | _seconds_with_other_values(
        checks, samples, recomputed.samples
    )
    for quantity, differ in differing.items():
        seconds = [second for second in differ if min((second + 1) * checks.rows, len(samples)) <= complete_rows]
        if seconds:
            second_count = len(checks.device_force)
            replayed.differences += (
                f"{name}: the {quantity} differs in {_list_seconds(seconds)} of {second_count} seconds",
            )


def _seconds_with_other_crcs(checks: recordings.Checks, recomputed: Any) -> dict[str, list[int]]:
    """Return, by kind of force, the seconds in which the CRC of the recomputed forces differs."""
    seconds_of = {}
    for force_name, recorded_crcs, forces in (
        ("force on the hand", checks.device_force, recomputed.device_force_n),
        ("force of the liquids", checks.effect_force, recomputed.force_n),
    ):
        crcs = recordings.crcs(forces, checks.rows)
        seconds_of[force_name] = [
            second
            for second, (recorded, computed) in enumerate(zip(recorded_crcs, crcs, strict=True))
            if recorded != computed
        ]
    return seconds_of


def _seconds_with_other_values(checks: recordings.Checks, samples: Any, recomputed: Any) -> dict[str, list[int]]:
    """Return, by column, the seconds in which recorded and recomputed values differ by more than rounding.

    Before the trial's own scene only forces are compared.
    """
    seconds_of = {}
    in_scene = samples.scene == samples.scene[-1]
    for name, step in recordings.ROUNDED_TO.items():
        recorded, computed = (np.nan_to_num(source[name].reshape(len(samples), -1)) for source in (samples, recomputed))
        permitted = step * (0.5 + _ROUNDING) + np.abs(computed) * _FLOAT32
        is_known = True if name in _FORCES else in_scene
        rows = np.flatnonzero((np.abs(recorded - computed) > permitted).any(axis=1) & is_known)
        seconds_of[f"column {name}"] = np.unique(rows // checks.rows).tolist()
    for name in ("limiters", "status"):
        rows = np.flatnonzero((samples[name] != recomputed[name]) & in_scene)
        seconds_of[f"column {name}"] = np.unique(rows // checks.rows).tolist()
    return seconds_of


def _samples_before_gap(ticks: NDArray[np.int64]) -> int:
    """Return the number of samples before the first missing one."""
    gaps = np.flatnonzero(np.diff(ticks) != 1)
    return int(gaps[0]) + 1 if gaps.size else len(ticks)


def _list_seconds(seconds: list[int]) -> str:
    shown = ", ".join(map(str, seconds[:_MAX_LISTED_SECONDS]))
    rest = f" … ({len(seconds)} in all)" if len(seconds) > _MAX_LISTED_SECONDS else ""
    return f"second {shown}{rest}"


def _recorded_presentations(
    lines: Sequence[events.Event],
) -> Iterator[tuple[events.TrialStarted, events.Which, events.Recorded | events.RecordingLost | None, str | None]]:
    """Yield each trial or interval with an expected recording, in order of presentation.

    Each has the line of the trial's start, its numbers, the event of the recording, and the time at which the session
    was last resumed or its device last reconnected; None before that.
    """
    ends = {line.which: line for line in lines if isinstance(line, events.Recorded | events.RecordingLost)}
    if not lines or not events.start_of(lines).recordings:
        return
    resumed_at: str | None = None
    started: events.TrialStarted | None = None
    for line in lines:
        if isinstance(line, events.SessionResumed | events.DeviceReconnected):
            resumed_at = line.at
        elif isinstance(line, events.TrialStarted):
            started = line
            if not line.has_intervals:
                yield line, line.which, ends.get(line.which), resumed_at
        elif isinstance(line, events.IntervalStarted) and started is not None:
            yield started, line.which, ends.get(line.which), resumed_at


def _recorded_setup(
    path: Path, session_receipt: Mapping[str, Any], key: Key, lines: Sequence[events.Event]
) -> tuple[Protocol, dict[str | None, _Device], tuple[int, str]]:
    """Return protocol, devices, and (seed, participant) of a session from its receipt at ``path``.

    Devices have the time at which they were opened again as keys; the first one has the key None.
    """
    with protocol_errors(path):
        described = {None: session_receipt["device"]} | {
            entry["at"]: entry["device"] for entry in session_receipt.get("resumed", ())
        }
        described |= {line.at: line.described for line in lines if isinstance(line, events.DeviceReconnected)}
        devices = {
            opened_at: _Device(float(device.get("force_limit_n", np.inf)), dynamics_from(device), rules_from(device))
            for opened_at, device in described.items()
        }
        seed_and_participant = session_receipt["seed"], session_receipt["participant"]
        return (
            recorded_protocol(complete_protocol(session_receipt["protocol"], key), session_receipt, key),
            devices,
            seed_and_participant,
        )
