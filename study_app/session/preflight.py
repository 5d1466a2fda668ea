"""Whether a session may begin: a pure judgement of what was measured before it, and how the motors were masked.

A failure refuses the session; a warning is something that would make trials invalid, or that somebody should know.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.devices.registry import descriptor_of
from study_app.haptics.model.device_dynamics import BELIEVED_TICKS, UNKNOWN, Dynamics
from study_app.haptics.model.slope_limits import refuses
from study_app.haptics.runtime.clocks.grants import NO_THREAD, Grant
from study_app.number_text import counted
from study_app.outlets.session_outlets import OutletStatus
from study_app.protocol.checks.force_limits import beyond_slope_limit, by_stimulus
from study_app.protocol.model import Protocol
from study_app.protocol.orders.durations import expected_duration_s
from study_app.protocol.orders.sequences import enrolment
from study_app.protocol.trials.presented_levels import highest_damping
from study_app.video.sources import VideosFound

if TYPE_CHECKING:
    from study_app.haptics.runtime.telemetry import Timing  # the compiler: whoever measures has loaded it

Means: TypeAlias = Literal["no", "headphones", "noise"]
MEANS: Final[dict[Means, str]] = {"no": "No", "headphones": "Headphones", "noise": "Noise"}
"""The answers to "Motors masked?", with their words."""
QUIETEST_DB, LOUDEST_DB, USUAL_DB = 30, 85, 60
"""Sound pressure levels of masking noise [dB]; above 85 dB hearing is at risk (Directive 2003/10/EC)."""
Verdict: TypeAlias = Literal["ok", "warning", "failure"]
LEAST_FRESH = 0.5  # share of ticks in which the device had a new sample
RATE_WARNING, RATE_FAILURE = 0.02, 0.5  # relative error of the servo's rate
LEAST_REFRESH_HZ = 50.0
SLOW_PROBE_S = 0.1
TABLES_BYTES = 20_000_000
RECORDED_BYTES_PER_S = 60e6 / 1800
MOST_OF_A_TICK = 0.2  # share of a tick that the force model may take
SAME = 1.1  # greatest ratio of two errors that count as equal
_UNKNOWN = {"delay_s": "delay", "count_m": "encoder count", "mass_kg": "mass"}
SPARE = 3  # times what a session of the expected length takes


@dataclass(frozen=True, slots=True)
class Masking:
    """The operator's answer; ``noise_db`` is the sound pressure level of the noise [dB], None without noise."""

    means: Means = "no"
    noise_db: int | None = None

    @property
    def entry(self) -> dict[str, Any]:
        """The answer as the receipt has it."""
        return {"means": self.means, "noise_db": self.noise_db}


@dataclass(frozen=True, slots=True)
class Screen:
    """The participant's screen: frames a second, and device pixels a pixel."""

    refresh_hz: float
    scaling: float


@dataclass(frozen=True, slots=True)
class Facts:
    """What was measured.

    ``fresh_share`` is the share of the servo's ticks in which the device had a new sample, ``sample_age_s`` how old the
    newest sample was when somebody looked (95th percentile). ``probe_s`` is how long a file took to be on the disk of
    the results, None where it could not be written for the reason ``probe_fault``; ``free_bytes`` None where unknown.
    ``tick_s`` is the time of a tick with the most expensive scene of the study, None if not measured; ``key_hash`` that
    of the study's sealed key, None before its first session. ``lateness_ns`` (n,) is that of every tick [ns],
    ``grant`` what the system lets the servo's thread do. ``dynamics`` are the device's, with its measured
    delay, ``delay_ticks`` is the delay that the servo uses now. ``withheld`` is the share of
    the force that limits and passivity controller are expected to withhold in the fastest stroke of a task, by
    liquid; None where it was not computed. ``velocity_errors`` are the relative error of the velocity and what it would
    be if all of the device's dynamics were known; None where all is. ``outlets`` are the streams and ports to other
    programs; ``video`` is what was found of the study's videos, None without any.
    """

    device: str
    fresh_share: float
    timing: Timing
    sample_age_s: float
    screen: Screen
    probe_s: float | None
    probe_fault: str
    free_bytes: int | None
    participant: str
    recordings: bool
    tick_s: float | None = None
    key_hash: str | None = None
    grant: Grant = NO_THREAD
    dynamics: Dynamics = UNKNOWN
    delay_ticks: int = BELIEVED_TICKS
    withheld: Mapping[str, float] | None = None
    velocity_errors: tuple[float, float] | None = None
    outlets: tuple[OutletStatus, ...] = ()
    video: VideosFound | None = None
    lateness_ns: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Check:
    """One result of the pre-flight: the verdict, the value, and what it is about.

    ``share`` is the measured value as a share of its limit, None without a limit. ``advice`` says in a sentence what to
    do, or, for a failure, why no session can begin.
    """

    name: str
    verdict: Verdict
    value: str
    about: str
    advice: str = ""
    share: float | None = None

    @property
    def said(self) -> str:
        """All of it in one line."""
        return "; ".join(filter(None, (self.value, self.about, self.advice)))

    @property
    def entry(self) -> dict[str, str]:
        """What the journal keeps of it."""
        return {"name": self.name, "verdict": self.verdict, "value": self.value, "about": self.about}

    def __str__(self) -> str:
        return f"{self.verdict:<8} {self.name:<15} {self.said}"


def checks(facts: Facts, protocol: Protocol) -> tuple[Check, ...]:
    """Return what is to be said of ``facts``, for a session of ``protocol``."""
    found = [
        _device(facts),
        _loop_delay(facts, protocol),
        _rate(facts, protocol),
        _lateness(facts, protocol),
        _priority(facts),
    ]
    found += _levels(facts, protocol)
    found += [
        _delay(facts, protocol),
        _screen(facts),
        _folder(facts),
        _space(facts, protocol),
        _blinding(facts, protocol),
        *_video(facts),
    ]
    found += _outlets(facts)
    return (*found, *_cost(facts, protocol), *_velocity(facts), *_withheld(facts, protocol), *_balance(facts, protocol))


def refused(found: Iterable[Check]) -> str:
    """Return why the session may not begin, in one line; empty if it may."""
    return "; ".join(f"{check.name.lower()}: {check.advice}" for check in found if check.verdict == "failure")


def _device(facts: Facts) -> Check:
    share = f"{100 * facts.fresh_share:.0f} %"
    about = f"{facts.device}, a new sample on {share} of ticks"
    if facts.timing.ticks == 0 or facts.fresh_share < LEAST_FRESH:
        advice = f"{facts.device} sends a new sample on only {share} of ticks: check its cable and power"
        return Check("Device", "failure", "not responding", about, advice)
    return Check("Device", "ok", "responding", about)


def _loop_delay(facts: Facts, protocol: Protocol) -> Check:
    """Say how late a force acts, which the force's limits follow."""
    value = _ticks(facts.delay_ticks)
    if facts.dynamics.delay_s is None:
        return Check("Loop delay", "ok", value, "assumed: the device does not measure its delay")
    about = f"delay until a force acts: {1e3 * facts.dynamics.delay_s:.2f} ms, measured by the device"
    if facts.delay_ticks > facts.dynamics.delay_ticks(protocol.device.rate_hz):
        about += " when it was opened; it measured more since"
    if facts.delay_ticks > BELIEVED_TICKS:
        return Check(
            "Loop delay", "warning", value, about, "Forces are limited more strictly: connect the device without a hub."
        )
    return Check("Loop delay", "ok", value, about)


def _levels(facts: Facts, protocol: Protocol) -> list[Check]:
    """Say whether every level can be delivered with the device's delay: the highest one, of blocks with a damper."""
    blocks = [block for block in protocol.blocks_in_order if block.stimulus is not None]
    highest_nspm = max((highest_damping(protocol, block) for block in blocks), default=0.0)
    if highest_nspm == 0:
        return []
    value, about = f"up to {highest_nspm:g} N·s/m", f"with a delay of {_ticks(facts.delay_ticks)}"
    for alike in by_stimulus(protocol):
        if (beyond := beyond_slope_limit(protocol, alike, facts.delay_ticks)) is not None:
            return [Check("Levels", "failure", value, about, f"{beyond.message}: {beyond.hint}")]
    return [Check("Levels", "ok", value, about)]


def _ticks(count: int) -> str:
    return counted(count, "tick")


def _rate(facts: Facts, protocol: Protocol) -> Check:
    asked, achieved = protocol.device.rate_hz, facts.timing.rate_hz
    value, about = f"{achieved:.1f} Hz", f"requested: {asked:g} Hz"
    unfelt = refuses(asked)
    if unfelt is not None:
        return Check("Servo rate", "failure", value, about, unfelt)
    error = abs(achieved / asked - 1)
    if error > RATE_FAILURE:
        return Check("Servo rate", "failure", value, about, f"{value}, {about}: close other programs")
    if error > RATE_WARNING:
        return Check("Servo rate", "warning", value, about, "Close other programs.")
    return Check("Servo rate", "ok", value, about)


def _lateness(facts: Facts, protocol: Protocol) -> Check:
    limits, timed = protocol.limits, facts.timing
    late_ms, gap_ms = timed.lateness_p99_s * 1e3, timed.worst_gap_s * 1e3
    share = max(late_ms / limits.lateness_ms, gap_ms / limits.worst_gap_ms)
    about = (
        f"99 % of ticks, limit {limits.lateness_ms:g} ms; worst gap {gap_ms:.1f} of {limits.worst_gap_ms:g} ms, "
        f"{timed.overruns} overruns"
    )
    advice = "" if share <= 1 else "Trials would be invalid: close other programs."
    verdict: Verdict = "ok" if share <= 1 else "warning"
    return Check("Servo lateness", verdict, f"{late_ms:.2f} ms", about, advice, share)


def _priority(facts: Facts) -> Check:
    """Say what the servo's thread was granted, and how to be granted more: others make an ordinary thread late."""
    grant = facts.grant
    memory = {None: "", True: ", memory locked", False: ", memory not locked"}[grant.locked]
    advice = "; ".join(f"{it[0].upper()}{it[1:]}" for it in grant.advice)
    verdict: Verdict = "ok" if grant.level in {"real-time", "none"} else "warning"
    return Check("Priority", verdict, grant.level, f"{grant.how}{memory}", f"{advice}." if advice else "")


def _delay(facts: Facts, protocol: Protocol) -> Check:
    """Judge the least delay that can be seen: the age of a sample, and a frame until it is on the screen."""
    limit_ms = protocol.limits.delay_error_ms
    seen_ms = (facts.sample_age_s + 1 / max(facts.screen.refresh_hz, 1.0)) * 1e3
    within = seen_ms <= limit_ms
    advice = "" if within else "Trials would be invalid: use a screen with a higher refresh rate."
    about = f"beyond the requested delay, limit {limit_ms:g} ms"
    verdict: Verdict = "ok" if within else "warning"
    return Check("Visual delay", verdict, f"up to {seen_ms:.1f} ms", about, advice, seen_ms / limit_ms)


def _screen(facts: Facts) -> Check:
    screen = facts.screen
    well = screen.refresh_hz >= LEAST_REFRESH_HZ and screen.scaling == 1
    advice = "" if well else "Set the participant's screen to 100 % scaling and at least 50 Hz."
    value = f"{screen.refresh_hz:.1f} Hz, {100 * screen.scaling:.0f} %"
    return Check(
        "Screen", "ok" if well else "warning", value, ("refresh rate and scaling of the participant's screen"), advice
    )


def _folder(facts: Facts) -> Check:
    if facts.probe_s is None:
        return Check("Results folder", "failure", "not usable", "no file could be written", facts.probe_fault)
    slow = facts.probe_s > SLOW_PROBE_S
    value, about = f"{facts.probe_s * 1e3:.1f} ms", "time to write a file"
    return Check("Results folder", "warning" if slow else "ok", value, about, "Use a local disk." if slow else "")


def _space(facts: Facts, protocol: Protocol) -> Check:
    recorded = RECORDED_BYTES_PER_S * expected_duration_s(protocol) if facts.recordings else 0.0
    needed = SPARE * (TABLES_BYTES + recorded)
    about = f"a session needs about {_megabytes(needed)} MB"
    if facts.free_bytes is None:
        return Check("Free space", "warning", "not known", about, "The system does not report the free space.")
    value = f"{_megabytes(facts.free_bytes)} MB free"
    if facts.free_bytes < needed:
        return Check("Free space", "failure", value, about, f"{value}, {about}: free disk space")
    return Check("Free space", "ok", value, about)


def _blinding(facts: Facts, protocol: Protocol) -> Check:
    """Say whether the study's key is sealed already; a study without a hidden condition has none."""
    blind = f"{protocol.study.blinding}-blind"
    if facts.key_hash is None:
        return Check("Blinding", "ok", blind, "the key is drawn and sealed when the first session begins")
    return Check("Blinding", "ok", blind, f"the key is sealed; its hash begins with {facts.key_hash[:8]}")


def _outlets(facts: Facts) -> Iterator[Check]:
    """Say of each outlet who listens, why it does not work, or why a double-blind study has none."""
    for one in facts.outlets:
        if one.withheld:
            yield Check(one.title, "ok", "off", "in a double-blind study: whoever sees the force can tell the liquid")
        elif one.lost:
            yield Check(one.title, "warning", "not available", one.lost, "The session can run without it.")
        elif one.shows_force:
            advice = "A viewer of the force can tell the liquid: show the stream to no one."
            who = "listener" if one.listens else "no listener"
            yield Check(one.title, "warning", who, "the study is double-blind", advice)
        elif one.listens is False:
            advice = "Start the program that records it, such as LabRecorder, and select this stream."
            yield Check(one.title, "warning", "no listener", "no program receives the stream", advice)
        else:
            about = "open" if one.listens is None else "a program receives the stream"
            yield Check(one.title, "ok", "ready" if one.listens is None else "listener", about)


def _video(facts: Facts) -> tuple[Check, ...]:
    """Say whether the study's videos can be shown; nothing that tells which condition shows one."""
    if facts.video is None:
        return ()
    if facts.video.fault:
        return (Check("Video", "failure", "not usable", facts.video.about, facts.video.fault),)
    return (Check("Video", "ok", "ready", facts.video.about),)


def _cost(facts: Facts, protocol: Protocol) -> tuple[Check, ...]:
    """Return how much of a tick the most expensive scene takes, if it was measured."""
    if facts.tick_s is None:
        return ()
    share = facts.tick_s * protocol.device.rate_hz
    value, about = f"{facts.tick_s * 1e9:.0f} ns per tick", f"most expensive scene: {100 * share:.2g} % of each tick"
    if share > MOST_OF_A_TICK:
        return (Check("Cost of the scenes", "warning", value, about, "Remove an effect from the scene.", share),)
    return (Check("Cost of the scenes", "ok", value, about, share=share),)


def _velocity(facts: Facts) -> tuple[Check, ...]:
    """Say what is not known of a device that gives force, and what that costs."""
    if facts.velocity_errors is None or not facts.dynamics.unknown or descriptor_of(facts.device).kind != "felt":
        return ()
    now, known = (100 * error for error in facts.velocity_errors)
    missing = [_UNKNOWN[name] for name in facts.dynamics.unknown]
    listed = " and ".join(filter(None, (", ".join(missing[:-1]), missing[-1])))
    about = f"error at 2 Hz, because the device's {listed} {'are' if len(missing) > 1 else 'is'} unknown"
    if now <= SAME * known:
        return (Check("Velocity", "ok", f"{now:.2g} %", about.replace("because", "although")),)
    advice = f"Measure the device: liquid-study devices bench {facts.device}."
    return (Check("Velocity", "warning", f"{now:.2g} % instead of {known:.2g} %", about, advice),)


def _withheld(facts: Facts, protocol: Protocol) -> tuple[Check, ...]:
    """Say what share of the force will be withheld, by liquid only where the operator may know liquids."""
    if not facts.withheld:
        return ()
    limit_percent, most_percent = protocol.limits.withheld_percent, 100 * max(facts.withheld.values())
    about = f"in the fastest stroke of a task, limit {limit_percent:g} %"
    if protocol.study.blinding == "single":
        about += ": " + ", ".join(f"{name} {100 * of:.1f} %" for name, of in sorted(facts.withheld.items()))
    within = most_percent <= limit_percent
    share = most_percent / limit_percent
    advice = "" if within else "Trials with such strokes would be invalid."
    verdict: Verdict = "ok" if within else "warning"
    return (Check("Force withheld", verdict, f"at most {most_percent:.1f} %", about, advice, share),)


def _balance(facts: Facts, protocol: Protocol) -> tuple[Check, ...]:
    """Say which row of a square the participant takes, where the protocol assigns rows."""
    if not protocol.assigns_rows:
        return ()
    number = enrolment(facts.participant)
    if number is None:
        advice = f"{facts.participant} has no number, so its row is drawn at random; use ids such as P007."
        return (Check("Balance", "warning", "drawn", "the row of the square", advice),)
    return (Check("Balance", "ok", f"participant number {number}", "determines the row of the square"),)


def _megabytes(count: float) -> str:
    return f"{count / 1e6:,.0f}".replace(",", " ")
