"""Intervals in recordings: the scenes presented, and the delivered levels, compared with the journal.

Recomputes every force of a session from the recorded times and places, by the tick that sent them.

The recordings contain the CRC-32 of each second of exact forces; here the forces are recomputed and compared with it.
The same kind of processor gives the same bits, by the version of the force rules that the receipt states; seconds that
differ are named. The delivered values of each interval are also recomputed and compared with the journal.

The key is opened only in memory, and not printed: the user who replays a session stays blind.

A recording begins shortly before its trial, so that the force it begins with is known; one that follows another without
a pause continues from its end. Parts that cannot be recomputed are listed, since they are not proved.
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
    """Return the steps of an interval that change a force, in order; empty if no level was set.

    ``started`` is the opened line on the trial's beginning; ``interval`` is None in a trial without intervals;
    ``lines`` is the session's journal.
    """
    if interval is None or started.level is None or interval != len(started.arrangement or ""):
        return ()
    presented = recorded_presentation(protocol, key.codes, started.fields()).intervals[interval - 1]
    made = [line for line in lines if isinstance(line, events.Stepped) and line.which == started.which]
    setting = protocol.adjusting(protocol.blocks[started.block], started.standard, started.level)
    if setting is None:
        return ()
    place, steps = 0, []
    for line in made:
        place = setting.moved(place, line.steps)
        if line.scene is not None:
            steps.append(
                Step(line.scene, protocol.presented_scene(replace(presented, value=setting.comparison(place))))
            )
    return tuple(steps)


def _with_last_scene_number(samples: Any, steps: Sequence[Step]) -> Any:
    """Return the samples (n,) with the number of an interval's last scene in place of its earlier scenes' numbers."""
    if not steps or len(samples) == 0:
        return samples
    out = samples.copy()
    out.scene[samples.scene >= steps[0].serial - 1] = samples.scene[-1]
    return out


def _step_starts(samples: Any, steps: Sequence[Step]) -> list[tuple[int, Scene]]:
    """Return the index of the first sample (n,) of each step with its scene, without steps that have no sample."""
    begins = ((np.flatnonzero(samples.scene >= step.serial), step.scene) for step in steps)
    return [(int(at[0]), scene) for at, scene in begins if at.size]


def _interval_samples(samples: Any, duration_s: float) -> Any:
    """Return the samples of an interval's task from its recording, which begins earlier and ends later.

    ``duration_s`` is the duration of the task in the journal.
    """
    own = samples[samples["scene"] == samples["scene"][-1]]
    believed = own[own["limiters"] & LIMITER_GLITCH == 0]
    until_ns = believed["time_ns"][:1] + round(duration_s * 1e9)
    return own[own["time_ns"] <= until_ns]


def _recompute_delivered(
    protocol: Protocol,
    presented: Stimulated,
    started: events.TrialStarted,
    interval: int,
    samples: Any,
    measured: Mapping[str, Any],
) -> Delivered:
    """Recompute the delivered values of an interval from the samples of its recording.

    ``started`` is the opened line on the beginning of the trial, ``measured`` the measures on the interval's end.
    """
    block = protocol.blocks[started.block]
    adjusted = protocol.design_of(block).adjusts and interval == len(started.arrangement or "")
    own = judged_fields(_interval_samples(samples, measured["duration_s"]))
    return delivered_values(protocol, presented, protocol.tasks[block.task], own, adjusted=adjusted)


def recompute_force_error(scene: Scene, rate_hz: float, samples: Any, ended: Mapping[str, Any]) -> float | None:
    """Recompute the force error of a trial or interval from its recording and the opened line on its end."""
    own = judged_fields(_interval_samples(samples, ended["duration_s"]))
    return delivered_error(own, rate_hz, scene.fade_s, partial(law_along, scene))


def differing_columns(recomputed: Mapping[str, float | None], ended: Mapping[str, Any]) -> Iterator[str]:
    """Yield the columns in which the journal differs from the recomputed values; none if it lacks them."""
    for name, value in recomputed.items():
        if name in ended and not _is_same(value, ended[name]):
            yield name


def _is_same(value: float | None, other: float | None) -> bool:
    if value is None or other is None:
        return value is other
    return bool(np.isclose(value, other, rtol=_TOLERANCE, atol=_TOLERANCE))


_NAMED_SECONDS = 8
_FORCES = ("force_n", "command_n", "device_force_n")
_ROUNDING = 1e-9
_FLOAT32 = 2.0**-23  # relative precision of recorded float32 values


@dataclass(slots=True, kw_only=True)
class Replayed:
    """The result of a replay.

    ``recordings`` were recomputed, ``seconds`` of them compared. ``differences`` has a sentence for each recording with
    different forces, ``missing`` one for each missing recording of the journal, ``uncompared`` one for each that could
    not be recomputed, or not to its end. ``lasted_s`` is the duration of the motion, ``computed_s`` that of the
    recomputation; ``took_s`` includes reading the files and loading the code.
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
    """Recompute every recorded force of a session, and compare.

    Raises
    ------
    StoreError
        It is not a session folder, or its journal, receipt, key or a recording cannot be read.

    Examples
    --------
    >>> from tempfile import mkdtemp
    >>> from study_app.session.simulated.rehearsal import rehearse
    >>> study = rehearse("demo", participants=1, seed=1, results=Path(mkdtemp(), "demo"))
    >>> found = replay(study / "data" / "sub-P001" / "ses-01")
    >>> found.recordings, found.differences, found.proved
    (4, (), True)
    """
    began = time.perf_counter()
    study, session = locate_session(session_folder)
    kept = receipt.read(session.receipt)
    key = read_key(study.path)
    if key.hash != kept["key_hash"]:
        raise StoreError(f"{study.key} is not the key for session {session.path}: restore it from a backup")
    lines = open_events(journal.read(session.journal), key)
    protocol, devices, (drawn_from, participant) = _recorded_setup(session.receipt, kept, key, lines)
    _recompute_forces(records(SAMPLE, 0), Scene(), devices[None], None)  # loads the compiled code before the timing
    replayed = Replayed()
    ends = {line.which: line for line in lines if isinstance(line, events.TrialEnded | events.IntervalEnded)}
    before: _Before | None = None
    resumed_at: str | None = None
    for started, which, line, resumed in _recorded_presentations(lines):
        if resumed != resumed_at:  # the servo was restarted: nothing continues from the previous recording
            before, resumed_at = None, resumed
        if resumed not in devices:
            raise StoreError(
                f"{session.receipt} does not state which device has been used since {resumed}: restore it from a backup"
            )
        name = attempt_name(*which)
        if not isinstance(line, events.Recorded):
            why = "the journal does not say why" if line is None else line.reason
            replayed.uncompared += (f"{name}: the recording is missing ({why})",)
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
        start = time.perf_counter()
        samples = _with_last_scene_number(recorded, steps)
        try:
            before = _recompute_forces(samples, scene, devices[resumed], before, _step_starts(recorded, steps))
        except StudyError as refused:
            before = None
            replayed.uncompared += (f"{name}: not recomputable: {refused}",)
            continue
        _compare_recording(replayed, name, samples, before, checks)
        if (ended := ends.get(which)) is not None and _samples_before_gap(samples.tick) == len(samples):
            again: dict[str, float | None] = {}
            measured = ended.others
            if interval is not None:
                presented = recorded_presentation(protocol, key.codes, started.fields()).intervals[interval - 1]
                again |= _recompute_delivered(protocol, presented, started, interval, samples, measured).columns
            if measured.get("delivered_error") is not None and ended.outcome != "interrupted":
                again["delivered_error"] = recompute_force_error(scene, protocol.device.rate_hz, samples, measured)
            replayed.differences += tuple(
                f"{name}: the column {column} differs" for column in differing_columns(again, measured)
            )
        replayed.computed_s += time.perf_counter() - start
    replayed.took_s = time.perf_counter() - began
    return replayed


class _Device(NamedTuple):
    """A device as recorded in a receipt, with the rules by which its forces were computed."""

    limit_n: float
    dynamics: Dynamics
    rules: ForceRules


@dataclass(slots=True, kw_only=True)
class _Before:
    """A recomputed recording and the final state of its models, from which the next recording may continue.

    ``knows_its_start``: it began without a force, or continues a recording of which that is true.
    """

    serial: int
    model: Any
    safety: Any
    samples: Any
    knows_its_start: bool = True


def _recompute_forces(
    samples: Any, scene: Scene, device: _Device, before: _Before | None, steps: Sequence[tuple[int, Scene]] = ()
) -> _Before:
    """Recompute the forces of ``samples`` in a copy; their own scene is that of the last sample.

    From the samples named in ``steps`` on it has other numbers.
    """
    out = samples.copy()
    serial = int(out.scene[-1]) if len(out) else 0
    limit_n, dynamics, rules = device
    rest = pack(scene.model_copy(update={"liquids": (), "fade_s": FADE_S}), dynamics=dynamics, rules=rules)
    model = pack(scene, dynamics=dynamics, rules=rules)
    first = 0
    shared = _shared_samples(before, out)
    if before is not None and shared is not None:
        first = shared
        _copy_forces(before.samples[len(before.samples) - first :], out[:first])
        _run_steps((rest, before.model, model), (before.serial, serial), before.safety[0], out, first, steps, device)
        return _Before(
            serial=serial, model=model, safety=before.safety, samples=out, knows_its_start=before.knows_its_start
        )
    safety = new_safety(limit_n)
    if len(out) and out.tick[0] != 0:
        _set_safety_state(safety[0], out)
        first = 1
    knows_its_start = not out.force_n[out.scene != serial].any()
    _run_steps((rest, rest, model), (0, serial), safety[0], out, first, steps, device)
    return _Before(serial=serial, model=model, safety=safety, samples=out, knows_its_start=knows_its_start)


def _shared_samples(before: _Before | None, out: Any) -> int | None:
    """Return the number of samples shared with the previous recording; None if this one does not continue it."""
    if before is None or len(out) == 0 or len(before.samples) == 0:
        return None
    shared = int(before.samples.tick[-1] + 1 - out.tick[0])
    return shared if 0 <= shared <= min(len(out), len(before.samples)) else None


def _copy_forces(known: Any, out: Any) -> None:
    for name in ("velocity_mps", "wake_mps", "force_n", "command_n", "device_force_n", "limiters", "status"):
        out[name] = known[name]


def _set_safety_state(safety: Any, out: Any) -> None:
    """Set the state of the safety layer to the first of the samples ``out``, which is recorded exactly.

    Only the length of a running fade matters, since no force is felt before the trial's own scene, which restarts the
    fade. The start's fade has ended if a later sample before the next scene shows no fade.
    """
    other = np.flatnonzero(out.scene != out.scene[0])
    lead = out[: other[0]] if other.size else out[:1]
    fades = bool((lead.limiters & LIMITER_FADE).all())
    safety.started = 1
    safety.tick_ns = safety.usable_ns = out.time_ns[0]
    safety.fade = 0.0 if fades else 1.0
    safety.fade_s = START_FADE_S if fades else 0.0
    safety.slewed_n[:] = out.command_n[0]


def _run_steps(
    models: tuple[Any, Any, Any],
    serials: tuple[int, int],
    safety: Any,
    out: Any,
    first: int,
    steps: Sequence[tuple[int, Scene]],
    device: _Device,
) -> None:
    """Run the models over ``out`` from ``first`` onwards, changing the scene's parameters at each step."""
    for place, scene in steps:
        recompute_scenes(*models, *serials, safety, out[:place], first)
        adjust_into(models[-1], scene, dynamics=device.dynamics, rules=device.rules)
        first = max(first, place)
    recompute_scenes(*models, *serials, safety, out, first)


def _compare_recording(replayed: Replayed, name: str, samples: Any, again: _Before, checks: recordings.Checks) -> None:
    """Compare one recording's checks with those of the recomputed forces."""
    if len(samples) == 0:
        replayed.uncompared += (f"{name}: the recording is empty",)
        return
    if not again.knows_its_start:
        replayed.uncompared += (f"{name}: the recording continues an earlier one, which is missing or has a gap",)
        return
    replayed.recordings += 1
    replayed.lasted_s += float(samples.time_ns[-1] - samples.time_ns[0]) * 1e-9
    whole = _samples_before_gap(samples.tick)
    if whole < len(samples):
        lost_s = whole / checks.rows
        replayed.uncompared += (f"{name}: samples are missing after {lost_s:.1f} s; the rest was not compared",)
    replayed.seconds += sum(
        min((second + 1) * checks.rows, len(samples)) <= whole for second in range(len(checks.device_force))
    )
    differing = _differing_sums(checks, again.samples) | _differing_columns(checks, samples, again.samples)
    for what, differ in differing.items():
        seconds = [second for second in differ if min((second + 1) * checks.rows, len(samples)) <= whole]
        if seconds:
            lasted = len(checks.device_force)
            replayed.differences += (f"{name}: the {what} differs in {_list_seconds(seconds)} of {lasted} seconds",)


def _differing_sums(checks: recordings.Checks, again: Any) -> dict[str, list[int]]:
    """Return, for each kind of force, the seconds whose exact forces have another CRC."""
    seconds_of = {}
    for what, kept, forces in (
        ("force on the hand", checks.device_force, again.device_force_n),
        ("force of the liquids", checks.effect_force, again.force_n),
    ):
        sums = recordings.crcs(forces, checks.rows)
        seconds_of[what] = [
            second for second, (recorded, other) in enumerate(zip(kept, sums, strict=True)) if recorded != other
        ]
    return seconds_of


def _differing_columns(checks: recordings.Checks, samples: Any, again: Any) -> dict[str, list[int]]:
    """Return, for each column, the seconds in which recorded and recomputed values differ by more than rounding.

    For the samples before the trial's own scene only the forces are known.
    """
    seconds_of = {}
    own = samples.scene == samples.scene[-1]
    for name, step in recordings.ROUNDED_TO.items():
        recorded, computed = (np.nan_to_num(it[name].reshape(len(samples), -1)) for it in (samples, again))
        permitted = step * (0.5 + _ROUNDING) + np.abs(computed) * _FLOAT32
        known = True if name in _FORCES else own
        rows = np.flatnonzero((np.abs(recorded - computed) > permitted).any(axis=1) & known)
        seconds_of[f"column {name}"] = np.unique(rows // checks.rows).tolist()
    for name in ("limiters", "status"):
        rows = np.flatnonzero((samples[name] != again[name]) & own)
        seconds_of[f"column {name}"] = np.unique(rows // checks.rows).tolist()
    return seconds_of


def _samples_before_gap(ticks: NDArray[np.int64]) -> int:
    """Return the number of samples before the first missing one."""
    gaps = np.flatnonzero(np.diff(ticks) != 1)
    return int(gaps[0]) + 1 if gaps.size else len(ticks)


def _list_seconds(seconds: list[int]) -> str:
    shown = ", ".join(map(str, seconds[:_NAMED_SECONDS]))
    more = f" … ({len(seconds)} in all)" if len(seconds) > _NAMED_SECONDS else ""
    return f"second {shown}{more}"


def _recorded_presentations(
    lines: Sequence[events.Event],
) -> Iterator[tuple[events.TrialStarted, events.Which, events.Recorded | events.RecordingLost | None, str | None]]:
    """Yield the start of each trial or interval with an expected recording, its numbers, and the recording's event.

    They are in order of presentation, each with the time at which the session was last resumed or its device
    reconnected; None before that.
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
    path: Path, kept: Mapping[str, Any], key: Key, lines: Sequence[events.Event]
) -> tuple[Protocol, dict[str | None, _Device], tuple[int, str]]:
    """Return protocol, devices, and seed with participant of a session from its receipt ``kept`` at ``path``.

    Devices are by the time at which they were opened again; that of the session's beginning is under None.
    """
    with protocol_errors(path):
        described = {None: kept["device"]} | {entry["at"]: entry["device"] for entry in kept.get("resumed", ())}
        described |= {line.at: line.described for line in lines if isinstance(line, events.DeviceReconnected)}
        devices = {
            at: _Device(float(device.get("force_limit_n", np.inf)), dynamics_from(device), rules_from(device))
            for at, device in described.items()
        }
        whose = kept["seed"], kept["participant"]
        return recorded_protocol(complete_protocol(kept["protocol"], key), kept, key), devices, whose
