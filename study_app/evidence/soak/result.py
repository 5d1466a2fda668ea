"""The result of a soak test: its numbers as text and as a machine-readable table, and the problems found."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

from study_app.devices.faulty import BUTTON, GLITCH, JUMP, KINDS, LOST, LOST_AT_WRITE, NON_FINITE, SILENCE
from study_app.evidence.soak.ledger import Drift
from study_app.evidence.soak.sample_audit import TOLERANCE_N
from study_app.evidence.table import Evidence
from study_app.haptics.model.layout import LIMITER_NAMES

_MAX_DRIFT: Final = 1e-9  # greatest wake error, in units of Σ|e|/S
_MAX_GROWTH_BYTES: Final = 5 * 2**20
_MAX_RESIDUE_N: Final = 1e-12
PERCEPTIBLE_N: Final = 0.05

_REPORTED_AS: Final = {
    NON_FINITE: "not_finite",
    GLITCH: "displaced",
    SILENCE: "silent",
    JUMP: "long_ticks",
    BUTTON: "buttons",
    LOST: "lost",
    LOST_AT_WRITE: "lost_at_write",
}


@dataclass(slots=True, kw_only=True)
class Rests:
    """The greatest wake [m/s] and force [N] that remained after the hand had been at rest.

    ``pushed_s`` is how long a force above ``PERCEPTIBLE_N`` was sent to a resting hand.
    """

    count: int = 0
    pushed_s: float = 0.0
    wake_mps: float = 0.0
    force_n: float = 0.0


class InjectedFault(NamedTuple):
    """The number of times a fault was injected, of affected readings, and of those that telemetry reports."""

    name: str
    times: int
    readings: int
    seen: int | None


@dataclass(frozen=True, kw_only=True)
class SoakResult:
    """The numbers of a soak test.

    ``memory`` [bytes] is read soon after the start, at every tenth and at the end; ``counts`` is a record of
    ``audit.COUNTS``, ``device`` one of ``faults.FAULTS``.
    """

    hours: float
    virtual: bool
    seed: int
    rate_hz: float
    scenes: tuple[str, ...]
    planned: int
    ticks: int
    took_s: float
    memory: tuple[int, ...]
    drift: Drift
    rests: Rests
    counts: Any
    device: Any
    overruns: int
    dropped: int
    recoveries: int
    loads: int
    stops: int

    @property
    def growth_bytes(self) -> int:
        """The increase in memory from soon after the start to the end."""
        return self.memory[-1] - self.memory[0]

    @property
    def faults(self) -> tuple[InjectedFault, ...]:
        """The injected faults of each kind."""
        rows = []
        for kind, name in enumerate(KINDS):
            is_counted = kind != JUMP or self.virtual  # a tick may take long for other reasons too
            seen = int(self.counts[_REPORTED_AS[kind]]) if is_counted else None
            times, readings = int(self.device.episodes[kind]), int(self.device.injected[kind])
            rows.append(InjectedFault(name, times=times, readings=readings, seen=seen))
        return tuple(rows)

    @property
    def findings(self) -> tuple[str, ...]:
        """One sentence per problem; empty if there is none."""
        checks = (*self._limit_checks(), *self._count_checks())
        return tuple(sentence for sentence, wrong in checks if wrong)

    def _limit_checks(self) -> Iterator[tuple[str, bool]]:
        """Yield the limits of samples, written forces and drift, and whether each is violated."""
        counts, device = self.counts, self.device
        first = f", first at tick {counts.first_tick}"
        yield f"{counts.excess} forces above the limit of {counts.limit_n:g} N{first}", counts.excess > 0
        yield f"{counts.no_number} non-finite forces{first}", counts.no_number > 0
        non_finite = int(counts.limiters[LIMITER_NAMES.index("non_finite")])
        yield f"{non_finite} non-finite liquid forces", non_finite > 0
        yield f"{device.not_finite} non-finite forces were written", device.not_finite > 0
        yield f"a force of {device.most_n:.3g} N was written", device.most_n > counts.limit_n + TOLERANCE_N
        yield (
            f"{counts.steps} steps of up to {counts.steepest_n:.3g} N, above the limit of {counts.slew_n:g} N{first}",
            counts.steps > 0,
        )
        yield f"{counts.unstopped} forces other than zero while stopped{first}", counts.unstopped > 0
        yield f"{counts.accepted} implausible readings accepted{first}", counts.accepted > 0
        yield f"the clock deviates from the ticks by up to {counts.drift_ns} ns{first}", counts.drift_ns > 0
        yield f"the last force written is {device.last_n.tolist()} N, not zero", bool(device.last_n.any())
        drift, rests = self.drift.worst, self.rests  # values that must not accumulate; NaN counts as too large
        yield f"the wake deviates from its definition by {drift:.2g} of Σ|e|/S", not drift <= _MAX_DRIFT
        yield f"a wake of {rests.wake_mps:.2g} m/s remains after a rest", rests.wake_mps != 0.0
        yield f"a force of {rests.force_n:.2g} N remains after a rest", not rests.force_n <= _MAX_RESIDUE_N
        yield f"memory grew by {_mebibytes(self.growth_bytes):.1f} MiB", self.growth_bytes > _MAX_GROWTH_BYTES

    def _count_checks(self) -> Iterator[tuple[str, bool]]:
        """Yield consistency checks between two independent counts; some require that no sample is missing."""
        counts = self.counts
        is_inconsistent = counts.samples + self.dropped != self.ticks or counts.missing > self.dropped
        yield f"{self.ticks} ticks do not equal {counts.samples} samples plus {self.dropped} dropped", is_inconsistent
        if self.dropped == 0:
            differs = counts.overruns != self.overruns
            yield f"{self.overruns} overruns, but the ticks imply {counts.overruns}", differs
            for name, _, readings, seen in self.faults:
                yield f"{readings} readings of {name}, but {seen} in telemetry", seen not in {None, readings}

    @property
    def verdict(self) -> str:
        if self.findings:
            return f"found: {'; '.join(self.findings)}"
        part = "" if self.ticks >= self.planned else f" in the {100 * self.ticks / self.planned:.1f} % that was run"
        return f"passed: no faults found{part}"

    def text(self) -> str:
        clock = "virtual" if self.virtual else "real"
        speed = self.ticks / self.rate_hz / self.took_s if self.took_s > 0.0 else 0.0
        speed_text = f", {speed:.0f} times as fast as real time" if self.virtual else ""
        return "\n".join(
            (
                f"soak test of {self.hours:g} h in {clock} time at {self.rate_hz:g} Hz, seed {self.seed}",
                f"liquids: {', '.join(self.scenes)}",
                f"{self.ticks:,} of {self.planned:,} ticks in {self.took_s:.1f} s{speed_text}",
                *self._drift_text(),
                *self._force_text(),
                *self._counter_text(),
                "",
                "memory [MiB]",
                f"  {' '.join(f'{_mebibytes(held):.1f}' for held in self.memory)}; "
                f"growth {_mebibytes(self.growth_bytes):+.1f}",
                "",
                self.verdict,
            )
        )

    def _drift_text(self) -> tuple[str, ...]:
        drift, rests = self.drift, self.rests
        return (
            "",
            "drift",
            f"  clock                 {self.counts.drift_ns} ns from the ticks at most",
            f"  wake                  {drift.worst:.1e} of Σ|e|/S from its definition at most, in "
            f"{drift.comparisons:,} "
            f"comparisons; the longest wake lasted {drift.longest_s:,.0f} s",
            f"  remains after {rests.count:,} rests   wake {rests.wake_mps:g} m/s, force {rests.force_n:.1e} N; above "
            f"{PERCEPTIBLE_N} N for at most {rests.pushed_s:.2f} s",
        )

    def _force_text(self) -> tuple[str, ...]:
        counts, device = self.counts, self.device
        return (
            "",
            "forces",
            f"  largest written       {device.most_n:.6f} N (limit {counts.limit_n:g} N), {device.writes:,} writes",
            f"  largest step          {counts.steepest_n:.6f} N",
            f"    at a stop or fault  {counts.release_step_n:.6f} N",
            f"    passivity control   {counts.energy_step_n:.6f} N",
            f"  non-finite forces     {counts.no_number + device.not_finite}",
        )

    def _counter_text(self) -> tuple[str, ...]:
        counts = self.counts
        limiters = zip(LIMITER_NAMES, counts.limiters.tolist(), strict=True)
        latest_ms = 1e3 * counts.latest_s
        return (
            "",
            "counters",
            f"  overruns {self.overruns:,}; dropped samples {self.dropped:,}; latest tick {latest_ms:.3f} ms late",
            f"  readings rejected {counts.refused:,}; stale faults {counts.stale:,}; recoveries {self.recoveries:,}",
            f"  scenes presented {self.loads:,}; force stopped by the host {self.stops:,} times",
            f"  limiters: {', '.join(f'{name} {ticks:,}' for name, ticks in limiters)}",
            "",
            f"  {'fault':<14}{'times':>10}{'readings':>12}{'seen':>12}",
            *(
                f"  {name:<14}{times:>10,}{readings:>12,}{'-' if seen is None else f'{seen:,}':>12}"
                for name, times, readings, seen in self.faults
            ),
        )

    def table(self) -> dict[str, Any]:
        return {
            "hours": self.hours,
            "virtual": self.virtual,
            "seed": self.seed,
            "rate_hz": self.rate_hz,
            "scenes": list(self.scenes),
            "ticks_planned": self.planned,
            "ticks": self.ticks,
            "took_s": self.took_s,
            "clock_drift_ns": int(self.counts.drift_ns),
            "wake_drift": self.drift.worst,
            "wake_comparisons": self.drift.comparisons,
            "longest_wake_s": self.drift.longest_s,
            "rests": self.rests.count,
            "residue_wake_mps": self.rests.wake_mps,
            "residue_force_n": self.rests.force_n,
            "pushed_at_rest_s": self.rests.pushed_s,
            "largest_force_n": float(self.device.most_n),
            "largest_step_n": float(self.counts.steepest_n),
            "largest_let_go_n": float(self.counts.release_step_n),
            "largest_energy_step_n": float(self.counts.energy_step_n),
            "latest_s": float(self.counts.latest_s),
            "overruns": self.overruns,
            "dropped": self.dropped,
            "refused": int(self.counts.refused),
            "stale_faults": int(self.counts.stale),
            "recoveries": self.recoveries,
            "scenes_presented": self.loads,
            "force_stops": self.stops,
            "limiters": dict(zip(LIMITER_NAMES, self.counts.limiters.tolist(), strict=True)),
            "faults": {name: {"times": n, "readings": r, "seen": seen} for name, n, r, seen in self.faults},
            "memory_bytes": list(self.memory),
            "findings": list(self.findings),
        }

    def evidence(self) -> Evidence:
        table = json.dumps(self.table(), indent=2, ensure_ascii=False)
        text = f"{self.text()}\n"
        return Evidence(text, {"soak.txt": text, "soak.json": f"{table}\n"}, missed=bool(self.findings))


def _mebibytes(held_bytes: float) -> float:
    return held_bytes / 2**20
