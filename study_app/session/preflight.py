"""The pre-flight checks that decide from measurements whether a session may begin.

A failure prevents the session. A warning reports a problem that would make trials invalid, or that the operator should
know.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.devices.registry import descriptor_of
from study_app.haptics.model.device_dynamics import ASSUMED_TICKS, UNKNOWN, Dynamics
from study_app.haptics.model.slope_limits import delayed_force_fault, refusal_reason
from study_app.haptics.runtime.grants import NO_THREAD, Grant
from study_app.number_text import counted
from study_app.outlets.session_outlets import OutletStatus
from study_app.protocol.checks import blocks_by_stimulus, slope_limit_fault
from study_app.protocol.model import Protocol
from study_app.protocol.orders import recordings_of
from study_app.protocol.presented import highest_damping
from study_app.protocol.randomization import enrolment_number
from study_app.protocol.warnings import UntranslatedText, listed_places
from study_app.protocol.wording import language_name
from study_app.store.blinded import recording_bytes
from study_app.store.session_progress import limit_reason
from study_app.video.sources import VideosFound

if TYPE_CHECKING:
    from study_app.haptics.runtime.telemetry import Timing  # loads the compiler

_Means: TypeAlias = Literal["no", "headphones", "noise"]
MEANS: Final[dict[_Means, str]] = {"no": "No", "headphones": "Headphones", "noise": "Noise"}
"""The answers to "Motors masked?", with their labels."""
QUIETEST_DB, LOUDEST_DB, USUAL_DB = 30, 85, 60
"""Sound pressure levels of masking noise [dB]; above 85 dB hearing is at risk (Directive 2003/10/EC)."""
_Verdict: TypeAlias = Literal["ok", "warning", "failure"]
_MIN_FRESH_SHARE = 0.5  # proportion of ticks in which the device had a new sample
RATE_WARNING, RATE_FAILURE = 0.02, 0.5  # relative error of the servo's rate
_MIN_REFRESH_HZ = 50.0
_SLOW_PROBE_S = 0.1
_TABLES_BYTES = 20_000_000
_MAX_TICK_SHARE = 0.2  # proportion of a tick that the force model may take
_EQUAL_ERROR_RATIO = 1.1  # greatest ratio of two errors that count as equal
_PROPERTY_NAMES = {"delay_s": "delay", "count_m": "encoder count", "mass_kg": "mass"}
_SPACE_FACTOR = 3  # required free space as a multiple of a session of the expected length


@dataclass(frozen=True, slots=True)
class Masking:
    """The operator's answer; ``noise_db`` is the sound pressure level of the masking noise [dB], None without it."""

    means: _Means = "no"
    noise_db: int | None = None

    @property
    def entry(self) -> dict[str, Any]:
        return {"means": self.means, "noise_db": self.noise_db}


@dataclass(frozen=True, slots=True)
class Screen:
    """The participant's screen: frames per second, and device pixels per logical pixel."""

    refresh_hz: float
    scaling: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PredictedDelivery:
    """The predicted loss of main trials because the safety layer withholds too much force.

    ``missing`` of the ``asked`` trials of intervals would not be delivered, and ``out`` of the ``judged`` other trials
    would violate limits. ``limit_percent`` is the limit on the withheld proportion of the force [%].
    """

    missing: int
    asked: int
    out: int
    judged: int
    limit_percent: float

    @property
    def sentences(self) -> tuple[str, ...]:
        """The predicted loss as sentences without full stops: "26 of 40 trials would not be delivered: …"."""
        reason = limit_reason("withheld_percent", {"withheld_percent": self.limit_percent})
        missing = f"{self.missing} of {counted(self.asked, 'trial')} would not be delivered: {reason}"
        violating = f"{self.out} of {counted(self.judged, 'trial')} would exceed the limits: {reason}"
        return (*([missing] if self.missing else []), *([violating] if self.out else []))


@dataclass(frozen=True, slots=True, kw_only=True)
class Measurements:
    """The measurements before a session.

    ``fresh_share`` is the proportion of the servo's ticks in which the device had a new sample, ``sample_age_s`` the
    age of the newest sample when read (95th percentile). ``probe_s`` is the time to write a file to the disk of the
    results, None if that failed for the reason ``probe_fault``; ``free_bytes`` is None if unknown. ``tick_s`` is the
    time of a tick with the most expensive scene of the study, None if not measured; ``key_hash`` is the hash of the
    study's sealed key, None before its first session. ``lateness_ns`` (n,) is the lateness of every tick [ns],
    ``grant`` the priority that the system grants the servo's thread. ``dynamics`` are the device's, with its measured
    delay, ``delay_ticks`` is the delay that the servo uses now. ``withheld`` is the proportion of the force that limits
    and passivity controller are expected to withhold in the fastest stroke of a task, by liquid; None if it was not
    computed. ``delivery`` is the predicted loss of a simulated participant, None if it was not computed.
    ``velocity_errors`` are the relative error of the velocity, and the error that it would have if all device dynamics
    were known; None if all are known. ``outlets`` are the streams and ports to other programs; ``video`` is the state
    of the study's videos, None without any. ``ran_otherwise`` is a participant whose session used the same version of
    the study from a different file; ``untranslated`` are texts of the pages that are still in another language.
    ``late_device`` is a sentence if the bench test or the last session showed that the device answers later than the
    servo assumes, else "".
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
    delay_ticks: int = ASSUMED_TICKS
    withheld: Mapping[str, float] | None = None
    delivery: PredictedDelivery | None = None
    velocity_errors: tuple[float, float] | None = None
    outlets: tuple[OutletStatus, ...] = ()
    video: VideosFound | None = None
    ran_otherwise: str = ""
    late_device: str = ""
    untranslated: tuple[UntranslatedText, ...] = ()
    lateness_ns: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64), compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Check:
    """One result of the pre-flight: the verdict, the value, and an explanation.

    ``share`` is the measured value as a proportion of its limit, None without a limit. ``advice`` is a sentence with
    the remedy or, for a failure, the reason why no session can begin.
    """

    name: str
    verdict: _Verdict
    value: str
    _: KW_ONLY
    about: str
    advice: str = ""
    share: float | None = None

    @property
    def said(self) -> str:
        return "; ".join(filter(None, (self.value, self.about, self.advice)))

    @property
    def entry(self) -> dict[str, str]:
        """The entry of this result in the journal."""
        return {"name": self.name, "verdict": self.verdict, "value": self.value, "about": self.about}

    def __str__(self) -> str:
        return f"{self.verdict:<8} {self.name:<15} {self.said}"


def preflight_checks(facts: Measurements, protocol: Protocol) -> tuple[Check, ...]:
    """Return the results of the pre-flight for a session of ``protocol`` with the measurements ``facts``."""
    return tuple(
        check
        for checks in (
            _servo_checks,
            _delayed_force_check,
            _level_check,
            _screen_and_disk_checks,
            _outlet_checks,
            _cost_checks,
        )
        for check in checks(facts, protocol)
    )


def refusal_reasons(checks: Iterable[Check]) -> str:
    """Return the reasons why the session cannot begin in one line; "" if it can."""
    return "; ".join(f"{check.name.lower()}: {check.advice}" for check in checks if check.verdict == "failure")


def _warning_unless(
    name: str, value: str, about: str, advice: str, *, passed: bool, share: float | None = None
) -> Check:
    """Return a check whose verdict is "ok" if ``passed``, else a warning with advice."""
    return Check(name, "ok" if passed else "warning", value, about=about, advice="" if passed else advice, share=share)


def _servo_checks(facts: Measurements, protocol: Protocol) -> Iterator[Check]:
    """Yield the checks of the device's response, its force delay and the servo's rate."""
    proportion = f"{100 * facts.fresh_share:.0f} %"
    about = f"{facts.device} sends a new sample in {proportion} of the ticks"
    if facts.timing.ticks == 0 or facts.fresh_share < _MIN_FRESH_SHARE:
        advice = f"{facts.device} sends a new sample in only {proportion} of the ticks: check its cable and power"
        yield Check("Device", "failure", "not responding", about=about, advice=advice)
    else:
        yield Check("Device", "ok", "responding", about=about)

    about, requested_hz = "assumed, because the device does not measure its delay", protocol.device.rate_hz
    if facts.dynamics.delay_s is not None:
        about = f"a force takes effect after {1e3 * facts.dynamics.delay_s:.2f} ms, as measured by the device"
        if facts.delay_ticks > facts.dynamics.delay_ticks(requested_hz):
            about += " when it was opened; it has measured a longer delay since"
    passed = (facts.dynamics.delay_s is None or facts.delay_ticks <= ASSUMED_TICKS) and not facts.late_device
    advice = "The force limits are stricter because of this delay; connect the device without a hub."
    if facts.late_device:
        remedy = f"connect the device without a hub, then measure it: liquid-study devices bench {facts.device}"
        advice = f"{facts.late_device}; {remedy}."
    yield _warning_unless("Loop delay", counted(facts.delay_ticks, "tick"), about, advice, passed=passed)

    value, about = f"{facts.timing.rate_hz:.1f} Hz", f"requested: {requested_hz:g} Hz"
    error = abs(facts.timing.rate_hz / requested_hz - 1)
    refusal = refusal_reason(requested_hz) or (
        f"{value}, {about}: close other programs" if error > RATE_FAILURE else None
    )
    if refusal is not None:
        yield Check("Servo rate", "failure", value, about=about, advice=refusal)
    else:
        yield _warning_unless("Servo rate", value, about, "Close other programs.", passed=error <= RATE_WARNING)

    limits = protocol.limits
    late_ms, gap_ms = facts.timing.lateness_p99_s * 1e3, facts.timing.worst_gap_s * 1e3
    worst = max(late_ms / limits.lateness_ms, gap_ms / limits.worst_gap_ms)
    about = (
        f"99th percentile (limit: {limits.lateness_ms:g} ms); largest gap {gap_ms:.1f} ms (limit: "
        f"{limits.worst_gap_ms:g} ms); {counted(facts.timing.overruns, 'overrun')}"
    )
    advice = "Trials would be invalid: close other programs."
    yield _warning_unless("Servo lateness", f"{late_ms:.2f} ms", about, advice, passed=worst <= 1, share=worst)

    grant = facts.grant  # other processes delay a thread of normal priority
    memory = {None: "", True: ", memory locked", False: ", memory not locked"}[grant.locked]
    advice = "; ".join(f"{sentence[0].upper()}{sentence[1:]}" for sentence in grant.advice)
    verdict: _Verdict = "ok" if grant.level in {"real-time", "none"} else "warning"
    yield Check("Priority", verdict, grant.level, about=f"{grant.how}{memory}", advice=f"{advice}." if advice else "")


def _delayed_force_check(facts: Measurements, protocol: Protocol) -> Iterator[Check]:
    """Yield the check whether rate and handle permit the delayed forces of the study, if it has any."""
    if not protocol.has_imperfect_link:
        return
    rate_hz, mass_kg = protocol.device.rate_hz, facts.dynamics.mass_kg
    advice = delayed_force_fault(rate_hz, mass_kg) or ""
    about = f"the study delays forces at {rate_hz:g} Hz, with a handle of {1000 * mass_kg:.0f} g"
    value = "not permitted" if advice else "permitted"
    yield Check("Delayed force", "failure" if advice else "ok", value, about=about, advice=advice)


def _level_check(facts: Measurements, protocol: Protocol) -> Iterator[Check]:
    """Yield the check whether the highest damping can be delivered with the device's delay."""
    blocks = [block for block in protocol.blocks_in_order if block.stimulus is not None]
    highest_nspm = max((highest_damping(protocol, block) for block in blocks), default=0.0)
    if highest_nspm == 0:
        return
    value, about = f"up to {highest_nspm:g} N·s/m", f"with a delay of {counted(facts.delay_ticks, 'tick')}"
    problems = (
        slope_limit_fault(protocol, similar_blocks, facts.delay_ticks)
        for similar_blocks in blocks_by_stimulus(protocol)
    )
    problem = next(filter(None, problems), None)
    advice = "" if problem is None else f"{problem.message}: {problem.hint}"
    yield Check("Levels", "ok" if problem is None else "failure", value, about=about, advice=advice)


def _screen_and_disk_checks(facts: Measurements, protocol: Protocol) -> Iterator[Check]:
    """Yield the checks of screen, disk, key and videos."""
    limit_ms, screen = protocol.limits.delay_error_ms, facts.screen
    delay_ms = (facts.sample_age_s + 1 / max(screen.refresh_hz, 1.0)) * 1e3  # the age of a sample plus one frame
    about, proportion = f"in addition to the requested delay (limit: {limit_ms:g} ms)", delay_ms / limit_ms
    advice = "Trials would be invalid: use a screen with a higher refresh rate."
    yield _warning_unless(
        "Visual delay", f"up to {delay_ms:.1f} ms", about, advice, passed=delay_ms <= limit_ms, share=proportion
    )

    value, about = f"{screen.refresh_hz:.1f} Hz, {100 * screen.scaling:.0f} %", "refresh rate and scaling of the "
    advice = "Set the participant's screen to 100 % scaling and at least 50 Hz."
    passed = screen.refresh_hz >= _MIN_REFRESH_HZ and screen.scaling == 1
    yield _warning_unless("Screen", value, f"{about}participant's screen", advice, passed=passed)

    if facts.probe_s is None:
        yield Check(
            "Results folder", "failure", "not usable", about="no file could be written", advice=facts.probe_fault
        )
    else:
        value, passed = f"{facts.probe_s * 1e3:.1f} ms", facts.probe_s <= _SLOW_PROBE_S
        yield _warning_unless("Results folder", value, "time to write a file", "Use a local disk.", passed=passed)

    planned = recordings_of(protocol) if facts.recordings else ()
    recorded = sum(count * recording_bytes(duration_s, protocol.device.rate_hz) for count, duration_s in planned)
    needed = _SPACE_FACTOR * (_TABLES_BYTES + recorded)
    about = f"a session needs about {_megabytes(needed)} MB"
    if facts.free_bytes is None:
        yield Check(
            "Free space",
            "warning",
            "not known",
            about=about,
            advice="The operating system does not report the free space.",
        )
    else:
        value, passed = f"{_megabytes(facts.free_bytes)} MB free", facts.free_bytes >= needed
        advice = "" if passed else f"{value}, {about}: free up some disk space"
        yield Check("Free space", "ok" if passed else "failure", value, about=about, advice=advice)

    about = "the key is generated and sealed when the first session begins"
    if facts.key_hash is not None:
        about = f"the key is sealed; its hash begins with {facts.key_hash[:8]}"
    yield Check("Blinding", "ok", f"{protocol.study.blinding}-blind", about=about)

    if facts.video is not None:  # must not reveal which condition shows a video
        fault = facts.video.fault
        value = "not usable" if fault else "ready"
        yield Check("Video", "failure" if fault else "ok", value, about=facts.video.about, advice=fault)


def _outlet_checks(facts: Measurements, _protocol: Protocol) -> Iterator[Check]:
    """Yield the check of each outlet: whether it has listeners, has failed, or is disabled by a double-blind study."""
    for outlet in facts.outlets:
        if outlet.withheld:
            yield Check(
                outlet.title,
                "ok",
                "off",
                about="because the study is double-blind and the force would reveal the liquid",
            )
        elif outlet.lost:
            yield Check(
                outlet.title, "warning", "not available", about=outlet.lost, advice="The session can run without it."
            )
        elif outlet.shows_force:
            advice = "Do not show the stream to anyone, because the force reveals the liquid."
            value = "listener" if outlet.listens else "no listener"
            yield Check(outlet.title, "warning", value, about="the study is double-blind", advice=advice)
        elif outlet.listens is False:
            advice = "Start the program that records it, such as LabRecorder, and select this stream."
            yield Check(outlet.title, "warning", "no listener", about="the stream is not being received", advice=advice)
        else:
            about = "open" if outlet.listens is None else "the stream is being received"
            yield Check(outlet.title, "ok", "ready" if outlet.listens is None else "listener", about=about)


def _cost_checks(facts: Measurements, protocol: Protocol) -> Iterator[Check]:
    """Yield the checks of computing time, unknown properties of the device, withheld force, and the row of a square."""
    if facts.tick_s is not None:
        proportion = facts.tick_s * protocol.device.rate_hz
        value, about = (
            f"{facts.tick_s * 1e9:.0f} ns per tick",
            f"the most demanding scene uses {100 * proportion:.2g} % of each tick",
        )
        advice, passed = "Remove an effect from the scene.", proportion <= _MAX_TICK_SHARE
        yield _warning_unless("Scene cost", value, about, advice, passed=passed, share=proportion)

    if facts.velocity_errors and facts.dynamics.unknown and descriptor_of(facts.device).kind == "felt":
        current_percent, known_percent = (100 * error for error in facts.velocity_errors)
        missing = [_PROPERTY_NAMES[name] for name in facts.dynamics.unknown]
        names = " and ".join(filter(None, (", ".join(missing[:-1]), missing[-1])))
        passed = current_percent <= _EQUAL_ERROR_RATIO * known_percent
        reason = (
            f"{'although' if passed else 'because'} the device's {names} {'are' if len(missing) > 1 else 'is'} unknown"
        )
        value = f"{current_percent:.2g} %" if passed else f"{current_percent:.2g} % instead of {known_percent:.2g} %"
        advice = f"Measure the device: liquid-study devices bench {facts.device}."
        yield _warning_unless("Velocity", value, f"error at 2 Hz, {reason}", advice, passed=passed)

    if facts.withheld:
        limit_percent, most_percent = protocol.limits.withheld_percent, 100 * max(facts.withheld.values())
        about = f"in the fastest stroke of a task (limit: {limit_percent:g} %)"
        if protocol.study.blinding == "single":  # the operator may know liquids
            about += ": " + ", ".join(
                f"{name} {100 * share_withheld:.1f} %" for name, share_withheld in sorted(facts.withheld.items())
            )
        proportion, value = most_percent / limit_percent, f"at most {most_percent:.1f} %"
        advice = "Trials with such strokes would be invalid."
        yield _warning_unless(
            "Force withheld", value, about, advice, passed=most_percent <= limit_percent, share=proportion
        )

    if facts.delivery is not None and facts.delivery.asked + facts.delivery.judged:
        lost = facts.delivery.missing + facts.delivery.out
        value = f"{lost} of {counted(facts.delivery.asked + facts.delivery.judged, 'trial')} beyond the limit"
        about = f"predicted for a delay of {counted(facts.delay_ticks, 'tick')}"
        advice = "; ".join(facts.delivery.sentences)
        yield _warning_unless("Trials delivered", value if lost else "all", about, f"{advice}.", passed=not lost)

    if facts.ran_otherwise:
        about = (
            f"version {protocol.study.version} has already been run from a different file, with {facts.ran_otherwise}"
        )
        advice = "Set a different study.version in the changed file; the report mentions the change either way."
        yield Check("Study file", "warning", "changed", about=about, advice=advice)

    if facts.untranslated:
        about = f"still in {language_name(facts.untranslated[0].source)}"
        advice = f"Pages mix two languages: translate {listed_places(facts.untranslated)}."
        yield Check("Translation", "warning", counted(len(facts.untranslated), "text"), about=about, advice=advice)

    if protocol.assigns_rows and protocol.groups:
        yield Check("Balance", "ok", "position in the group", about="determines the row of the Latin square")
    elif protocol.assigns_rows and (number := enrolment_number(facts.participant)) is not None:
        yield Check("Balance", "ok", f"participant number {number}", about="determines the row of the Latin square")
    elif protocol.assigns_rows:
        advice = f"{facts.participant} does not contain a number, so the row is drawn at random; use IDs such as P007."
        yield Check("Balance", "warning", "drawn", about="row of the Latin square", advice=advice)


def _megabytes(count: float) -> str:
    return f"{count / 1e6:,.0f}".replace(",", " ")
