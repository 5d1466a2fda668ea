"""Whether a session may begin: a pure judgement of what was measured before it.

A failure refuses the session; a warning is something that would make trials invalid, or that somebody should know.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from study_app.haptics.limits import refuses
from study_app.haptics.telemetry import Timing
from study_app.protocol.describe import expected_duration_s
from study_app.protocol.model import Protocol
from study_app.protocol.squares import enrolment

Verdict: TypeAlias = Literal["ok", "warning", "failure"]

LEAST_FRESH = 0.5  # share of turns in which the device had a new sample
RATE_WARNING, RATE_FAILURE = 0.02, 0.5  # relative error of the servo's rate
LEAST_REFRESH_HZ = 50.0
SLOW_PROBE_S = 0.1
TABLES_BYTES = 20_000_000
RECORDED_BYTES_PER_S = 60e6 / 1800
SPARE = 3  # times what a session of the expected length takes


@dataclass(frozen=True, slots=True)
class Screen:
    """The participant's screen: frames a second, and device pixels a pixel."""

    refresh_hz: float
    scaling: float


@dataclass(frozen=True, slots=True)
class Facts:
    """What was measured.

    ``fresh_share`` is the share of the servo's turns in which the device had a new sample, ``sample_age_s`` how old the
    newest sample was when somebody looked (95th percentile). ``probe_s`` is how long a file took to be on the disk of
    the results, None where it could not be written for the reason ``probe_fault``; ``free_bytes`` None where unknown.
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


@dataclass(frozen=True, slots=True)
class Check:
    """One thing looked at, and what to say of it."""

    name: str
    verdict: Verdict
    said: str

    def __str__(self) -> str:
        return f"{self.verdict:<8} {self.name:<15} {self.said}"


def checks(facts: Facts, protocol: Protocol) -> tuple[Check, ...]:
    """Return what is to be said of ``facts``, for a session of ``protocol``."""
    found = [_device(facts), _rate(facts, protocol), _lateness(facts, protocol), _delay(facts, protocol)]
    found += [_screen(facts), _folder(facts), _space(facts, protocol)]
    return (*found, *_balance(facts, protocol))


def refused(found: Iterable[Check]) -> str:
    """Return why the session may not begin, in one line; empty if it may."""
    return "; ".join(f"{check.name.lower()}: {check.said}" for check in found if check.verdict == "failure")


def _device(facts: Facts) -> Check:
    if facts.timing.ticks == 0 or facts.fresh_share < LEAST_FRESH:
        said = f"{facts.device} has a new sample in {facts.fresh_share:.0%} of the turns: check its cable and power"
        return Check("Device", "failure", said)
    return Check("Device", "ok", f"{facts.device} answers")


def _rate(facts: Facts, protocol: Protocol) -> Check:
    asked, achieved = protocol.device.rate_hz, facts.timing.rate_hz
    unfelt = refuses(asked)
    if unfelt is not None:
        return Check("Servo rate", "failure", unfelt)
    error = abs(achieved / asked - 1)
    verdict: Verdict = "failure" if error > RATE_FAILURE else "warning" if error > RATE_WARNING else "ok"
    hint = "" if verdict == "ok" else ": close other programs"
    return Check("Servo rate", verdict, f"{achieved:.1f} Hz, asked for {asked:g} Hz{hint}")


def _lateness(facts: Facts, protocol: Protocol) -> Check:
    limits, timed = protocol.limits, facts.timing
    late_ms, gap_ms = timed.lateness_p99_s * 1e3, timed.worst_gap_s * 1e3
    within = late_ms <= limits.lateness_ms and gap_ms <= limits.worst_gap_ms
    said = (
        f"99 % of turns within {late_ms:.2f} ms (limit {limits.lateness_ms:g} ms), worst gap {gap_ms:.1f} ms "
        f"(limit {limits.worst_gap_ms:g} ms), {timed.overruns} overruns"
    )
    return Check("Servo lateness", "ok" if within else "warning", said if within else f"{said}: trials would not count")


def _delay(facts: Facts, protocol: Protocol) -> Check:
    """Judge the least delay that can be seen: the age of a sample, and a frame until it is on the screen."""
    limit_ms = protocol.limits.delay_error_ms
    seen_ms = (facts.sample_age_s + 1 / max(facts.screen.refresh_hz, 1.0)) * 1e3
    verdict: Verdict = "ok" if seen_ms <= limit_ms else "warning"
    return Check("Visual delay", verdict, f"up to {seen_ms:.1f} ms beyond the one asked for (limit {limit_ms:g} ms)")


def _screen(facts: Facts) -> Check:
    screen = facts.screen
    well = screen.refresh_hz >= LEAST_REFRESH_HZ and screen.scaling == 1
    hint = "" if well else ": use 100 % and at least 50 Hz for the participant's screen"
    return Check("Screen", "ok" if well else "warning", f"{screen.refresh_hz:.1f} Hz, {screen.scaling:.0%}{hint}")


def _folder(facts: Facts) -> Check:
    if facts.probe_s is None:
        return Check("Results folder", "failure", facts.probe_fault)
    slow = facts.probe_s > SLOW_PROBE_S
    said = f"a file is on the disk in {facts.probe_s * 1e3:.1f} ms"
    return Check("Results folder", "warning" if slow else "ok", f"{said}: use a local disk" if slow else said)


def _space(facts: Facts, protocol: Protocol) -> Check:
    if facts.free_bytes is None:
        return Check("Free space", "warning", "not known")
    recorded = RECORDED_BYTES_PER_S * expected_duration_s(protocol) if facts.recordings else 0.0
    needed = SPARE * (TABLES_BYTES + recorded)
    said = f"{_megabytes(facts.free_bytes)} MB free, a session is given {_megabytes(needed)} MB"
    if facts.free_bytes < needed:
        return Check("Free space", "failure", f"{said}: make room")
    return Check("Free space", "ok", said)


def _balance(facts: Facts, protocol: Protocol) -> tuple[Check, ...]:
    """Say which row of a square the participant takes, where the protocol deals rows."""
    if not any(block.order in ("williams", "latin") for block in protocol.blocks_in_order):
        return ()
    number = enrolment(facts.participant)
    if number is None:
        said = f"{facts.participant} has no number: its row is drawn, not dealt; use ids such as P007"
        return (Check("Balance", "warning", said),)
    return (Check("Balance", "ok", f"the order of participant number {number}"),)


def _megabytes(count: float) -> str:
    return f"{count / 1e6:,.0f}".replace(",", " ")
