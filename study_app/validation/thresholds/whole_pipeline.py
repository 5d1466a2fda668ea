"""Three participants with a planted threshold through servo, store, unblinding and analysis."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

from study_app.analysis.designs.thresholds import thresholds
from study_app.analysis.tables.study import load_study
from study_app.analysis.tables.tracks import tracks
from study_app.evaluation.replay import replay
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.blinded.unblinding import unblind
from study_app.store.folders import StudyFolder
from study_app.store.verification.reproduction import reproduced
from study_app.store.verification.verify_study import verify
from study_app.validation.thresholds.estimated_exponents import PlantedExponent, recovered_exponent
from study_app.validation.thresholds.planted import Planted
from study_app.validation.thresholds.verdicts import Verdict

PEOPLE: Final = 3
DELIVERED_LEAST: Final = 0.99
SPREADS: Final = 3


def run(
    one: Planted | PlantedExponent,
    source: str,
    folder: Path,
    spread: float,
    *,
    seed: int,
    progress: Callable[[str], object] | None = None,
) -> Iterator[Verdict]:
    """Rehearse a study in ``folder`` and yield what it shows.

    Parameters
    ----------
    one : Planted
        What is planted.
    source : str
        File or name of its protocol.
    folder : Path
        A study folder that is not there yet.
    spread : float
        Standard deviation of ln threshold, or of the exponent, over studies of `PEOPLE`.
    seed : int
        Of all randomness.
    progress : callable, optional
        Called with a line after each session.
    """
    rehearse(source, participants=PEOPLE, seed=seed, results=folder, progress=progress, observer=one.observer)
    sessions = StudyFolder(folder).sessions()
    findings = len(verify(folder, None).errors)
    findings += sum(len(reproduced(session.path).differences) for session in sessions)
    findings += sum(not replay(session.path).proved for session in sessions)
    unblind(folder, "validate", "to compare with what was planted")
    study = load_study(folder)
    intervals = study.intervals[study.intervals["block"] == one.block.id]
    delivered = float(intervals["invalid_reasons"].isna().mean())
    yield Verdict(
        one.name,
        "intervals delivered as requested",
        f"{100 * delivered:.2f} %",
        "at least 99 %",
        delivered >= DELIVERED_LEAST,
    )
    yield Verdict(one.name, "findings of verify, reproduce and replay", str(findings), "0", findings == 0)
    if isinstance(one, PlantedExponent):
        yield recovered_exponent(one, tracks(study), spread, PEOPLE)
        return
    block = next(block for block in study.levels if block.id == one.block.id)
    values = [row.threshold for row in thresholds(block, tracks(study)) if row.participant is not None]
    error = sum(math.log(value / one.threshold) for value in values) / len(values)
    yield Verdict(
        one.name,
        f"threshold of {PEOPLE} people, {_unit(one)}",
        f"{one.threshold * math.exp(error):.3g}",
        f"{one.threshold:g} ± {SPREADS} SD ({100 * SPREADS * spread:.0f} %)",
        abs(error) <= SPREADS * spread,
    )


def _unit(one: Planted) -> Any:
    return "ms" if one.threshold > 1 else "Weber fraction"
