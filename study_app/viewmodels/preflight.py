"""What the window before a session shows, as one frozen value. No Qt here.

Nothing here says a liquid, a parameter or a delay: costs and errors are those of the most expensive and the least
accurate scene.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from study_app.devices.descriptor import NOT_AVAILABLE, Backend
from study_app.protocol.describe import spread
from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import orders_of
from study_app.protocol.orders.schedule import Schedule, Trial
from study_app.session.preflight import Check, Measurements, checks
from study_app.session.resume import resume_at
from study_app.store.journals.journal_events import Event
from study_app.store.progress import progress_of
from study_app.viewmodels.home import extent_of
from study_app.viewmodels.session import operator_language, step_title

WAITING = "measuring …"
BINS_PER_DECADE = 10


@dataclass(frozen=True, slots=True)
class PreflightView:
    """Everything on the window.

    ``rows`` are (label, value) of what will run; ``lateness_us`` is what was measured of the servo's ticks (n,), and
    ``limit_us`` what the protocol allows. While it is ``busy`` nothing can be begun.
    """

    study: str
    who: str
    checks: tuple[Check, ...]
    rows: tuple[tuple[str, str], ...]
    lateness_us: NDArray[np.float64]
    limit_us: float
    busy: bool = False

    @property
    def warnings(self) -> int:
        return sum(check.verdict == "warning" for check in self.checks)

    @property
    def failures(self) -> int:
        return sum(check.verdict == "failure" for check in self.checks)

    @property
    def passed(self) -> str:
        """How many passed: "8 of 9 passed"."""
        well = len(self.checks) - self.warnings - self.failures
        return f"{well} of {len(self.checks)} passed"

    @property
    def start_words(self) -> str:
        """What the button says: that warnings are accepted by pressing it, or that it cannot be pressed."""
        if self.failures:
            return "Cannot start"
        if self.warnings:
            return f"Start with {self.warnings} warning{'s' if self.warnings > 1 else ''}"
        return "Start"


def preflight_view(
    protocol: Protocol,
    facts: Measurements,
    found: tuple[Check, ...],
    who: str,
    *,
    error_n: float | None = None,
    asked_error: bool = True,
    now: datetime,
    busy: bool = False,
    goes_on: tuple[tuple[str, str], ...] = (),
) -> PreflightView:
    """Return what to show of ``facts``; ``goes_on`` are the rows of a session that goes on (`resumed_rows`).

    ``error_n`` is the largest difference of a scene's force from the exact definition [N], None while it is not
    known; where no one was asked (``asked_error``) its line is left out.
    """
    return PreflightView(
        study=protocol.study.name,
        who=who,
        checks=found,
        rows=(*goes_on, *_rows(protocol, now, error_n, asked_error=asked_error)),
        lateness_us=facts.lateness_ns / 1e3,
        limit_us=protocol.limits.lateness_ms * 1e3,
        busy=busy,
    )


def resumed_rows(protocol: Protocol, schedule: Schedule, lines: Iterable[Event]) -> tuple[tuple[str, str], ...]:
    """Return where the session with these journal lines goes on, and how much of it is kept.

    Raises
    ------
    SessionError
        The journal is not of this schedule.
    """
    journal = list(lines)
    start = resume_at(protocol, schedule, journal)
    language = operator_language(protocol)
    step = schedule.steps[start.step] if start.step < len(schedule.steps) else None
    if isinstance(step, Trial):
        attempt = start.presented.get(step.number, 0) + 1
        here = step.label(protocol, language) + (f", attempt\u00a0{attempt}" if attempt > 1 else "")
    else:
        here = "the end" if step is None else step_title(protocol, step, language)
    kept = f"{sum(progress_of(journal).answered.values())} of {orders_of(protocol).answers} answers"
    return ("Continues at", here), ("Kept", kept)


def histogram(lateness_us: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64], float | None]:
    """Return edges [µs], counts and the 99th percentile [µs] of latenesses; what is below 1 µs counts as 1 µs."""
    highest = max(1e3, float(lateness_us.max(initial=0.0)))
    edges = np.logspace(0, np.ceil(np.log10(highest) + 1e-9), int(3 * BINS_PER_DECADE) + 1)
    counts, _ = np.histogram(np.maximum(lateness_us, 1.0), edges)
    return edges, counts.astype(np.int64), float(np.percentile(lateness_us, 99)) if len(lateness_us) else None


def _rows(
    protocol: Protocol, now: datetime, error_n: float | None, *, asked_error: bool
) -> tuple[tuple[str, str], ...]:
    extent = extent_of(protocol)
    ends = now + timedelta(seconds=max(extent.expected_s))
    error = WAITING if error_n is None else "< 0.01 N" if error_n < 0.01 else f"{error_n:.2f} N"
    return (
        ("Parts", spread(extent.parts)),
        (f"{extent.setting.capitalize()}s", spread(extent.settings)),
        ("Answers", spread(extent.answers)),
        ("Expected time", extent.duration),
        ("Force limit", f"{protocol.device.force_limit_n:g} N"),
        *((("Expected force error", error),) if asked_error else ()),
        ("Ends about", f"{ends:%H:%M}"),
    )


OF_THE_COMPUTER: Final = ("Servo rate", "Servo lateness", "Priority", "Screen", "Results folder", "Free space")
"""The checks before a session that say nothing of the study or its device."""

RECOMPILES: Final = "Every start compiles again, for up to a minute: set NUMBA_CACHE_DIR to a writable folder."


def computer_checks(
    facts: Measurements, protocol: Protocol, devices: Sequence[Backend], *, cache: Path | None, compiled: int
) -> tuple[Check, ...]:
    """Return what is to be said of a computer.

    ``facts`` were measured with the simulated hand, for which ``compiled`` functions had to be compiled; the protocol's
    limits apply; ``cache`` is the folder of compiled code, None where nothing can be stored.
    """
    of_servo = {check.name: check for check in checks(facts, protocol)}
    found = [of_servo[name] for name in OF_THE_COMPUTER]
    return (*found, _devices(devices), _compiled(cache, compiled))


def _devices(devices: Sequence[Backend]) -> Check:
    """Say which haptic devices are connected; without one sessions run with the mouse."""
    haptic = [one for one in devices if one.state.startswith("connected")]
    missing = [one.name for one in devices if one.state == NOT_AVAILABLE]
    about = f"cannot be used now: {', '.join(missing)}" if missing else "every device can be used"
    if haptic:
        return Check("Haptic devices", "ok", ", ".join(one.name for one in haptic), about)
    advice = "Connect one, then look at Devices; without one only the mouse and the simulated hand can be used."
    return Check("Haptic devices", "warning", "none connected", about, advice)


def _compiled(cache: Path | None, compiled: int) -> Check:
    if cache is None:
        return Check("Compiled code", "warning", "not stored", "no folder is writable", RECOMPILES)
    value = f"{compiled} functions compiled" if compiled else "stored"
    return Check("Compiled code", "ok", value, f"the force model for this processor, in {cache}")
