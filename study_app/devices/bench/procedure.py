"""The bench test of a device: a fixed procedure of ten minutes, and its report as Markdown and as JSON.

The procedure measures the device at rest, its mass and friction, its greatest stable damping, and its force on a scale.
The report contains no folder names of this computer. With a simulated device, its hand answers instead of an operator.
"""

import json
import platform
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any, Final

from study_app import __version__
from study_app.devices.base import Device
from study_app.devices.bench.excitation import ENDED, OSCILLATES, RATE_HZ, Excitation, Stand
from study_app.devices.bench.measurements import (
    GRAVITY_MPS2,
    Gain,
    Motion,
    Noise,
    Regularity,
    gain_of,
    motion_under_force,
    noise,
    regularity,
)
from study_app.errors import DeviceError
from study_app.haptics.runtime.clocks import Clock

Ask = Callable[[str, str], Callable[[], str | None]]
"""Asks the operator: takes the kind of request ("let-go", "scale", "grams" or "damping") and its text, and returns a
function that returns None until the operator has answered, then the answer."""
_AXES: Final = "xyz"
_SPRING_NPM: Final = 100.0
_SPRING_NSPM: Final = 6.0
_INTEGRAL_PER_S: Final = 0.7
_WAVE_N: Final = 2.0
_WEAK_SHARE: Final = 0.4
_START_HZ: Final = 1.5
_END_HZ: Final = 25.0
_REACH_M: Final = 0.045
_MAX_SLIP_M: Final = 0.03
"""Greatest motion of a handle that pushes on a scale [m]; a greater one means that it has slipped off."""
_MAX_NSPM: Final = 150.0
_SHAKE_N: Final = 0.35
"""RMS force of the damper above 20 Hz that counts as oscillation. [choice]"""
_STROKE_N: Final = 0.6
_STROKE_HZ: Final = 0.7
_MIN_EXPLAINED: Final = 0.95
"""Smallest explained fraction of the force's variance; simulated handles give 0.998 to 0.9996."""
_LEVELS_N: Final = (0.0, 1.0, 2.0, 3.0, 1.0)
_PATIENCE_S: Final = 600.0
_FORMAT: Final = 1
_POOR_FIT_NOTE: Final = (
    f"Mass, damping and friction explain less than {100 * _MIN_EXPLAINED:g} % of the force: somebody may have "
    "touched the handle, or it may have hit an end stop. Measure again."
)
_END_REASONS: Final = {
    "oscillation": "it oscillated",
    "operator": "stopped by the operator",
    "most": "stable up to the largest damping tried",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Durations:
    """The duration of each part [s]; by default ten minutes in total with the operator's answers."""

    rest_s: float = 120.0  # without force
    come_s: float = 6.0  # for the spring to move the handle to the centre
    wave_s: float = 30.0  # chirp on each axis for mass and friction
    push_s: float = 4.0  # until the force on the scale is steady
    damping_s: float = 60.0  # until the damper has grown to `_MOST_NSPM`, on each axis


@dataclass(frozen=True, slots=True)
class StableDamping:
    """The greatest stable damping of an axis [N·s/m].

    ``ended`` is the reason why the increase ended: "oscillation", "operator" or "most" (the greatest damping tried).
    """

    damping_nspm: float
    ended: str


@dataclass(frozen=True, slots=True)
class Found:
    """The results of a bench test.

    Attributes
    ----------
    device : the device's own description
    regularity, noise : timing of the loop and noise of the position, at rest
    motions : mass, damping and friction of the axes x, y, z
    gain : of the force downward; None without a scale
    damping : greatest stable damping of the axes x, y, z
    overruns : number of deadlines that the servo skipped
    """

    device: dict[str, Any]
    regularity: Regularity
    noise: Noise
    motions: tuple[Motion, ...]
    gain: Gain | None
    damping: tuple[StableDamping, ...]
    overruns: int

    @property
    def count_m(self) -> float | None:
        """The coarsest encoder count of the three axes [m]; None if the handle moved too little."""
        counts_um = [motion.count_um for motion in self.motions if motion.count_um > 0.0]
        return 1e-6 * max(counts_um) if counts_um else None

    @property
    def fits(self) -> bool:
        """Whether mass, damping and friction explain the handle's motion, as they do unless something touched it."""
        return all(motion.explained >= _MIN_EXPLAINED and motion.mass_kg > 0.0 for motion in self.motions)


def run_bench(
    device: Device,
    ask: Ask,
    *,
    progress: Callable[[str], object],
    durations: Durations | None = None,
    clock: Clock | None = None,
) -> Found:
    """Measure an open device, and leave it with zero force in any case.

    Parameters
    ----------
    progress : callable
        Receives the progress, one line at a time.
    clock : Clock, optional
        Default: the system's.

    Raises
    ------
    DeviceError
        The device was lost, or ended the measurement.
    """
    durations = durations or Durations()
    with Stand(device, clock) as stand:
        _wait_for_answer(
            stand, ask("let-go", "Let go of the handle and keep clear of it until you are asked to use the scale.")
        )
        progress(f"Measuring at rest, without force, for {durations.rest_s:g} s.")
        samples, _ = stand.run(durations.rest_s)
        loop_timing, rest_noise = regularity(samples, RATE_HZ), noise(samples)
        motions = tuple(_measure_motion(stand, axis, durations, progress) for axis in range(3))
        damping = tuple(_measure_damping(stand, axis, durations, ask, progress) for axis in range(3))
        gain = _measure_gain(stand, durations, ask, progress)
        stand.rest()
        return Found(device.describe(), loop_timing, rest_noise, motions, gain, damping, stand.overruns)


def _hold_excitation(**more: Any) -> Excitation:
    return Excitation(
        **{
            "stiffness_npm": _SPRING_NPM,
            "damping_nspm": _SPRING_NSPM,
            "integral_per_s": _INTEGRAL_PER_S,
            "reach_m": 2 * _REACH_M,
            **more,
        }
    )


def _measure_motion(stand: Stand, axis: int, durations: Durations, progress: Callable[[str], object]) -> Motion:
    """Move the handle to the centre, excite it with a chirp, and fit its response."""
    stand.excite(_hold_excitation())
    stand.run(durations.come_s)
    strong_n = min(_WAVE_N, stand.limit_n / 2)
    progress(f"Measuring mass and friction along {_AXES[axis]} for {durations.wave_s:g} s with up to {strong_n:.1f} N.")
    sweep = (_END_HZ - _START_HZ) / (durations.wave_s / 2)
    segments = []
    for wave_n in (strong_n, _WEAK_SHARE * strong_n):
        stand.excite(_hold_excitation(integral_per_s=0.0, axis=axis, wave_n=wave_n, from_hz=_START_HZ, hz_per_s=sweep))
        samples, _ = stand.run(durations.wave_s / 2)
        segments.append(samples)
    stand.rest()
    return motion_under_force(segments, axis, RATE_HZ)


def _measure_damping(
    stand: Stand, axis: int, durations: Durations, ask: Ask, progress: Callable[[str], object]
) -> StableDamping:
    """Move the handle back and forth with growing damping until it oscillates, is stopped or reaches the limit."""
    stand.excite(_hold_excitation())
    stand.run(durations.come_s)
    progress(
        f"Measuring stable damping along {_AXES[axis]}: the damping rises to {_MAX_NSPM:g} N·s/m in "
        f"{durations.damping_s:g} s."
    )
    answered = ask("damping", "The measurement ends when the handle oscillates; press Enter to end it earlier.")
    stand.excite(
        _hold_excitation(
            integral_per_s=0.0,
            axis=axis,
            wave_n=min(_STROKE_N, stand.limit_n / 4),
            from_hz=_STROKE_HZ,
            rise_nspm_per_s=_MAX_NSPM / durations.damping_s,
            most_nspm=_MAX_NSPM,
            shake_limit_n=_SHAKE_N,
        )
    )
    _, answer = stand.run(durations.damping_s, answered=answered, may_end=True)
    reached = stand.damper_nspm
    ended = stand.ended
    stand.rest()
    if ended is None:
        return StableDamping(reached, "most" if answer is None else "operator")
    if ended != ENDED[OSCILLATES]:
        raise DeviceError(
            f"the bench test stopped because {ended}; the force is zero: check the device, then start again"
        )
    return StableDamping(reached, "oscillation")


def _measure_gain(stand: Stand, durations: Durations, ask: Ask, progress: Callable[[str], object]) -> Gain | None:
    """Push down on a scale and ask for its reading."""
    request = (
        "Rest the handle on a kitchen scale, near the middle of the handle's range, and set the scale to zero. If you "
        "do not have a scale, type 'no'."
    )
    if _wait_for_answer(stand, ask("scale", request)).lower().startswith("n"):
        progress("The force was not measured with a scale.")
        return None
    sent_n, shown_g = [], []
    for level_n in _LEVELS_N:
        if level_n > 0.75 * stand.limit_n:
            continue
        stand.excite(Excitation(push_n=(0.0, -level_n, 0.0), reach_m=_MAX_SLIP_M))
        samples, _ = stand.run(durations.push_s)
        answer = _wait_for_answer(
            stand, ask("grams", f"The device is pushing down with {level_n:g} N. What does the scale show, in grams?")
        )
        shown_g.append(_parse_grams(answer))
        sent_n.append(-float(samples.device_force_n[-len(samples) // 4 :, 1].mean()))
    stand.rest()
    return gain_of(sent_n, shown_g)


def _wait_for_answer(stand: Stand, answered: Callable[[], str | None]) -> str:
    _, answer = stand.run(_PATIENCE_S, answered=answered)
    if answer is None:
        raise DeviceError(f"there was no answer within {_PATIENCE_S:g} s, so the bench test stopped; the force is zero")
    return answer


def _parse_grams(answer: str) -> float:
    try:
        return float(answer.replace(",", ".").removesuffix("g").strip())
    except ValueError:
        raise DeviceError(
            f"'{answer}' is not a scale reading, so the bench test stopped: enter a number of grams, such as 102"
        ) from None


def as_json(results: Found, day: str) -> str:
    """Return the results as JSON text; ``day`` is the date of the test, such as 2026-11-21."""
    document = {
        "format": _FORMAT,
        "kind": "devices bench",
        "measured": day,
        "program": __version__,
        "system": _system_description(),
        **asdict(results),
    }
    return json.dumps(_plain_json(document), indent=2, ensure_ascii=False) + "\n"


def as_markdown(results: Found, day: str) -> str:
    """Return the report as Markdown text."""
    return "\n".join(_report_lines(results, day)) + "\n"


def workstation_results(results: Found, day: str) -> dict[str, Any]:
    """Return the results for this computer's settings (`store.workstation.DeviceBench`)."""
    axis_fields = ("mass_kg", "damping_nspm", "friction_n", "delay_ms")
    return {
        "name": results.device["name"],
        "serial": results.device.get("serial") or "",
        "measured": day,
        **{name: tuple(float(getattr(motion, name)) for motion in results.motions) for name in axis_fields},
        "count_m": results.count_m,
        "stable_nspm": tuple(axis.damping_nspm for axis in results.damping),
        "gain": None if results.gain is None else results.gain.gain,
    }


def _report_lines(results: Found, day: str) -> Iterator[str]:
    loop, rest = results.regularity, results.noise
    yield from (f"# Bench of {results.device.get('name')}", "")
    serial = f", serial number {results.device['serial']}" if results.device.get("serial") else ""
    yield from (f"{day}{serial}; liquid-study {__version__}; {_system_description()}.", "")
    yield from ("## Loop", "", "| | median | 99 % | greatest |", "| --- | ---: | ---: | ---: |")
    yield f"| lateness of a tick [ms] | {_table_row(loop.lateness_ms, 3)} |"
    yield f"| duration of a tick, including reading and writing [ms] | {_table_row(loop.busy_ms, 3)} |"
    yield ""
    minimum, maximum = loop.delay_ticks
    delay = f"{minimum}" if minimum == maximum else f"{minimum} to {maximum}"
    yield (
        f"Of {loop.ticks} ticks, {100 * loop.new_share:.2f} % had a new position; new positions were at most "
        f"{loop.longest_gap_ms:.2f} ms apart. The driver's delay was {delay} ticks. The servo skipped "
        f"{results.overruns} deadlines."
    )
    yield from ("", "## At rest, without force", "", "| | x | y | z |", "| --- | ---: | ---: | ---: |")
    yield f"| standard deviation of the position [µm] | {_table_row(rest.position_um, 2)} |"
    yield f"| range of the position [µm] | {_table_row(rest.peak_um, 2)} |"
    yield from ("", f"Velocity (EWMA, weight 0.1): {rest.velocity_mmps:.3f} mm/s RMS; drift {rest.drift_um:.1f} µm.")
    yield from ("", "## Mass, damping, friction", "", "| | x | y | z |", "| --- | ---: | ---: | ---: |")
    for label, name, digits in (
        ("apparent mass [kg]", "mass_kg", 3),
        ("damping [N·s/m]", "damping_nspm", 2),
        ("Coulomb friction [N]", "friction_n", 3),
        ("delay from force command to motion [ms]", "delay_ms", 1),
        ("size of an encoder count, estimated from the noise during motion [µm]", "count_um", 1),
        ("proportion of force variance explained", "explained", 4),
    ):
        yield f"| {label} | {_table_row(tuple(getattr(motion, name) for motion in results.motions), digits)} |"
    if not results.fits:
        yield from ("", _POOR_FIT_NOTE)
    yield from (
        "",
        "## Largest stable damping",
        "",
        "| axis | damping [N·s/m] | reason for stopping |",
        "| --- | ---: | --- |",
    )
    for axis, damping in zip(_AXES, results.damping, strict=True):
        yield f"| {axis} | {damping.damping_nspm:.0f} | {_END_REASONS[damping.ended]} |"
    yield from (
        "",
        f"The handle was free while the damping was increased; a force of more than {_SHAKE_N:g} N RMS above 20 Hz "
        "counts as oscillation.",
    )
    yield from ("", "## Force on a scale", "")
    gain = results.gain
    yield (
        "Not measured."
        if gain is None
        else f"{gain.gain:.3f} N measured per newton sent, downward; offset {gain.offset_n:+.3f} N; largest residual "
        f"{gain.residual_n:.3f} N; {gain.readings} readings."
    )
    yield from ("", "## What the device reports", "", "```json")
    yield json.dumps(_plain_json(results.device), indent=2, ensure_ascii=False)
    yield "```"


def _table_row(values: tuple[float, ...], digits: int) -> str:
    return " | ".join(f"{value:.{digits}f}" for value in values)


def _system_description() -> str:
    return f"{platform.system()} {platform.release()}, {platform.machine()}, Python {platform.python_version()}"


def _plain_json(value: Any) -> Any:
    """Return a value with replacements for types unknown to JSON: numpy's numbers, NaN."""
    if isinstance(value, dict):
        return {str(name): _plain_json(entry) for name, entry in value.items()}
    if hasattr(value, "_asdict"):
        return _plain_json(value._asdict())
    if isinstance(value, list | tuple):
        return [_plain_json(entry) for entry in value]
    if hasattr(value, "item"):
        value = value.item()
    return None if isinstance(value, float) and value != value else value  # noqa: PLR0124 - NaN


def ask_simulated_hand(device: Any, progress: Callable[[str], object]) -> Ask:
    """Return an `Ask` that the simulated hand of a device answers: it releases the handle, or acts as the scale.

    The hand is the device's ``hand``, or the device itself; it has ``held`` and the motors' ``force_n``.
    """
    hand = getattr(device, "hand", device)

    def ask(kind: str, request: str) -> Callable[[], str | None]:
        if kind in ("let-go", "scale"):
            hand.held = kind == "scale"
            progress(request)
        if kind == "scale":
            hand.reach_to(0.0, 0.0, 0.0)
        if kind == "damping":
            return lambda: None
        if kind == "grams":
            return lambda: f"{-1e3 * float(hand.force_n[1]) / GRAVITY_MPS2:.1f}"
        return lambda: ""

    return ask
