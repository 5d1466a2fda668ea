"""What is known of a study, many simulated studies of it on an executor, and three participants of the whole program.

These pass through servo, store, unblinding and analysis.
"""

import math
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

from study_app.analysis.data.study_tables import Study, load_study
from study_app.analysis.levels.thresholds import estimated_exponents, thresholds
from study_app.analysis.levels.tracks import tracks
from study_app.evidence.table import run
from study_app.evidence.thresholds.estimated_exponents import (
    KnownExponent,
    exponent_verdicts,
    known_exponent,
    recovered_exponent,
    simulate_estimates,
    spread_of_exponents,
)
from study_app.evidence.thresholds.known_thresholds import (
    SHIPPED,
    KnownThreshold,
    Verdict,
    known_threshold,
    simulate,
    spread,
    verdicts,
)
from study_app.protocol.model import Protocol
from study_app.session.replay import replay
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.blinded.unblinding import unblind
from study_app.store.folders import StudyFolder
from study_app.store.verification.reproduction import reproduced
from study_app.store.verification.verify_study import verify

PEOPLE: Final = 3
DELIVERED_LEAST: Final = 0.99
SPREADS: Final = 3


@dataclass(frozen=True, slots=True)
class Rehearsed:
    """What rehearsed participants show.

    Attributes
    ----------
    delivered : float
        Share of intervals that were delivered as requested.
    findings : int
        Of ``verify``, ``reproduce`` and ``replay``.
    recovered : tuple of float
        Each participant's threshold at each standard, or each participant's exponent.
    """

    delivered: float
    findings: int
    recovered: tuple[float, ...]


def rehearsed(one: KnownThreshold | KnownExponent, source: bytes, seed: int) -> Rehearsed:
    """Rehearse `PEOPLE` participants in a temporary folder, from the source of a protocol; return what they show."""
    with tempfile.TemporaryDirectory() as place:
        file, folder = Path(place) / f"{one.name}.toml", Path(place) / "study"
        file.write_bytes(source)
        rehearse(str(file), participants=PEOPLE, seed=seed, results=folder, observer=one.observer)
        sessions = StudyFolder(folder).sessions()
        findings = len(verify(folder, None).errors)
        findings += sum(len(reproduced(session.path).differences) for session in sessions)
        findings += sum(not replay(session.path).proved for session in sessions)
        unblind(folder, "validate", "to compare with what is known")
        study = load_study(folder)
        intervals = study.intervals[study.intervals["block"] == one.block.id]
        return Rehearsed(float(intervals["invalid_reasons"].isna().mean()), findings, _recovered(one, study))


def _recovered(one: KnownThreshold | KnownExponent, study: Study) -> tuple[float, ...]:
    rows = tracks(study)
    block = next(block for block in study.levels if block.id == one.block.id)
    if isinstance(one, KnownExponent):
        return tuple(found.exponent for found in estimated_exponents(block, rows) if found.participant is not None)
    return tuple(row.threshold for row in thresholds(block, rows) if row.participant is not None)


def judged(one: KnownThreshold | KnownExponent, found: Rehearsed, spread: float) -> Iterator[Verdict]:
    """Yield the verdicts on rehearsed participants.

    ``spread`` is the standard deviation of ln threshold, or of the exponent, over studies of `PEOPLE`.
    """
    yield Verdict(
        one.name,
        "intervals delivered as requested",
        f"{100 * found.delivered:.2f} %",
        "at least 99 %",
        found.delivered >= DELIVERED_LEAST,
    )
    clean = found.findings == 0
    yield Verdict(one.name, "findings of verify, reproduce and replay", str(found.findings), "0", clean)
    if isinstance(one, KnownExponent):
        yield recovered_exponent(one, found.recovered, spread)
        return
    error = sum(math.log(value / one.threshold) for value in found.recovered) / len(found.recovered)
    yield Verdict(
        one.name,
        f"threshold of {PEOPLE} people, {_unit(one)}",
        f"{one.threshold * math.exp(error):.3g}",
        f"{one.threshold:g} ± {SPREADS} SD ({100 * SPREADS * spread:.0f} %)",
        abs(error) <= SPREADS * spread,
    )


def _unit(one: KnownThreshold) -> Any:
    return "ms" if one.threshold > 1 else "Weber fraction"


NAMES: Final = (*SHIPPED, "thickness")
"""The shipped studies that are validated."""


def known_value(name: str, protocol: Protocol) -> KnownThreshold | KnownExponent:
    """Return what is known of a study.

    Raises
    ------
    ValueError
        Nothing can be.
    """
    return known_exponent(name, protocol) or known_threshold(name, protocol)


def methods_alone(
    one: KnownThreshold | KnownExponent, studies: int, seed: int, executor: Executor, progress: Callable[[int], object]
) -> tuple[list[Verdict], float]:
    """Return the verdicts of many studies of equal observers, and the spread of studies of `PEOPLE`.

    ``progress`` is called with the number of finished studies.
    """
    numbers = [(number,) for number in range(studies)]
    if isinstance(one, KnownExponent):
        exponents = run(partial(simulate_estimates, one, seed=seed), numbers, executor, progress)
        return list(exponent_verdicts(one, exponents)), spread_of_exponents(exponents, PEOPLE)
    thresholds = run(partial(simulate, one, seed=seed), numbers, executor, progress)
    return list(verdicts(one, thresholds)), spread(thresholds, PEOPLE)
