"""Studies of equal observers with a known threshold, by the choice of levels and the analysis alone, and verdicts.

No servo and no store take part: what is presented is what was requested, so that errors are those of methods and
estimates.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from study_app.analysis.data.blocks import LevelBlock
from study_app.analysis.levels.thresholds import ThresholdFound, jnd_slope, thresholds
from study_app.analysis.planning.power_curves import interval as wilson_interval
from study_app.evidence.table import Evidence, Table
from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.simulated import OBSERVER, Observer, simulate_study
from study_app.protocol.trials.stimuli import DELAYS
from study_app.protocol.trials.tracks import design_of, method_of, standards_of, stimulus_of

SHIPPED: Final[dict[str, Observer]] = {
    "viscosityjnd": OBSERVER,
    "delaydetect": Observer(delay_jnd_s=0.045),
    "delayjnd": OBSERVER,
    "forcedelay": Observer(delay_jnd_s=0.015),
}
"""The shipped studies with thresholds. Known are a Weber fraction of 0.24 at 75 % correct, which is 0.19 at 71 %
(Jones, Hunter & Lafontaine 1997), 45 ms (Vogels 2004), 25 ms at every standard (below 33 ms: Ellis et al. 1999),
and 15 ms of a force (Rank et al. 2010)."""


@dataclass(frozen=True, slots=True)
class KnownThreshold:
    """A study's main block with an adaptive method, and the observer who answers."""

    name: str
    protocol: Protocol
    block: Block
    observer: Observer

    @property
    def threshold(self) -> float:
        """The threshold, as a level: a Weber fraction or a difference [ms]."""
        if stimulus_of(self.protocol, self.block).vary in DELAYS:
            return 1000 * self.observer.delay_jnd_s
        return self.observer.weber_fraction

    @property
    def standards(self) -> tuple[float, ...]:
        """The standards, in the unit of the varied number."""
        return tuple(one for one in standards_of(self.protocol, self.block) if one is not None)

    @property
    def exponent(self) -> float | None:
        """The slope of ln JND over ln standard: 1 by Weber's law, 0 where the JND is constant; None of one standard."""
        if len(self.standards) < 2:
            return None
        return 0.0 if stimulus_of(self.protocol, self.block).vary in DELAYS else 1.0


def known_threshold(name: str, protocol: Protocol) -> KnownThreshold:
    """Return what is known of a study.

    Raises
    ------
    ValueError
        The study has no main block of forced choices of distances from a standard.
    """
    for block in protocol.main_blocks:
        if block.stimulus is None or block.design is None:
            continue
        stimulus = stimulus_of(protocol, block)
        if stimulus.level_kind != "value" and not all(one is None for one in standards_of(protocol, block)):
            return KnownThreshold(name, protocol, block, SHIPPED.get(name, OBSERVER))
    raise ValueError(
        f"{name} has no main block with levels above a standard, or with magnitude estimation of a liquid at a pace: "
        "nothing is known of it in advance"
    )


PEOPLE: Final = 10


@dataclass(frozen=True, slots=True)
class StudyFound:
    """Threshold, low and high of each standard that the analysis found: the group's, and each person's (``own``)."""

    group: tuple[tuple[float, float, float], ...]
    own: tuple[tuple[tuple[float, float, float], ...], ...]

    @property
    def mean(self) -> float:
        """The geometric mean of the group's thresholds over the standards."""
        return math.exp(sum(math.log(one[0]) for one in self.group) / len(self.group))

    def mean_of(self, people: int) -> float:
        """Return the geometric mean over standards and the first participants."""
        values = [math.log(one[0]) for person in self.own[:people] for one in person]
        return math.exp(sum(values) / len(values))


def simulate(
    one: KnownThreshold, number: int, seed: int, people: int = PEOPLE, observers: Sequence[Observer] = ()
) -> StudyFound:
    """Return what a study of equal observers finds; ``number`` names its draws.

    ``observers`` differ, and take part in place of ``people`` equal ones.
    """
    who = {f"P{at:03d}": observer for at, observer in enumerate(observers or (one.observer,) * people, start=1)}
    rows = pd.DataFrame(simulate_study(one.protocol, who, seed, f"validate/{one.name}/{number}"))
    frame = rows[rows["block"] == one.block.id].assign(session=1, level_delivered=rows["level"], analysed=True)
    found = list(thresholds(_level_block(one), frame.astype({"level_delivered": "Float64", "success": "boolean"})))
    group = tuple(_ends(row) for row in found if row.participant is None)
    own = tuple(tuple(_ends(row) for row in found if row.participant == name) for name in who)
    return StudyFound(group, own)


def slopes(one: KnownThreshold, found: StudyFound) -> list[float]:
    """Return each participant's slope of ln JND over ln standard."""
    standards = np.array(one.standards)
    unit = standards if stimulus_of(one.protocol, one.block).level_kind == "weber" else 1.0
    return [jnd_slope(standards, np.array([row[0] for row in person]) * unit) for person in found.own]


def _ends(row: ThresholdFound) -> tuple[float, float, float]:
    assert row.low is not None and row.high is not None  # noqa: S101, PT018 - ten participants have an interval
    return row.threshold, row.low, row.high


def _level_block(one: KnownThreshold) -> LevelBlock:
    block, protocol = one.block, one.protocol
    return LevelBlock(
        id=block.id,
        title=block.id,
        phase=block.phase,
        design=design_of(protocol, block),
        stimulus=stimulus_of(protocol, block),
        settings=(),
        method=method_of(protocol, block),
    )


ERROR_MOST: Final = 0.05
NEAR: Final = 0.15
NEAR_SHARE: Final = 0.95
OWN_COVERAGE: Final = (0.93, 0.99)
EXPONENT_MOST: Final = 0.15


@dataclass(frozen=True, slots=True)
class Verdict:
    """One judged value: what it is of, the value and its limit in words, and whether it keeps to the limit."""

    study: str
    what: str
    value: str
    limit: str
    holds: bool


def verdicts(one: KnownThreshold, studies: Sequence[StudyFound]) -> Iterator[Verdict]:
    """Yield what studies of equal observers show of methods and analysis."""
    errors = np.array([math.log(found.mean / one.threshold) for found in studies])
    mean = math.exp(float(errors.mean())) - 1
    yield Verdict(
        one.name, "mean error of the threshold", f"{100 * mean:+.1f} %", "within ±5 %", abs(mean) <= ERROR_MOST
    )
    near, n = int((np.abs(np.expm1(errors)) <= NEAR).sum()), len(studies)
    yield Verdict(
        one.name,
        f"studies of {PEOPLE} within ±15 %",
        f"{100 * near / n:.1f} %",
        "at least 95 % (Wilson interval)",
        wilson_interval(near / n, n)[1] >= NEAR_SHARE,
    )
    of_group = [low <= one.threshold <= high for found in studies for _, low, high in found.group]
    yield group_coverage(one.name, sum(of_group) / len(of_group), n)
    of_people = [low <= one.threshold <= high for found in studies for own in found.own for _, low, high in own]
    share = sum(of_people) / len(of_people)
    low, high = OWN_COVERAGE
    yield Verdict(
        one.name,
        "coverage of participants' 95 % intervals",
        f"{100 * share:.1f} %",
        f"{100 * low:.0f} to {100 * high:.0f} %",
        low <= share <= high,
    )
    if one.exponent is not None:
        exponent = float(np.mean([slope for found in studies for slope in slopes(one, found)]))
        yield Verdict(
            one.name,
            "exponent of JND over standard",
            f"{exponent:.3f}",
            f"{one.exponent:g} ± {EXPONENT_MOST:g}",
            abs(exponent - one.exponent) <= EXPONENT_MOST,
        )


def group_coverage(study: str, share: float, studies: int) -> Verdict:
    """Return whether the share of the group's intervals that hold the truth is 95 %, but for chance."""
    slack = 3 * math.sqrt(0.95 * 0.05 / studies)
    limit = f"95 ± {100 * slack:.1f} %"
    what = "coverage of the group's 95 % intervals"
    return Verdict(study, what, f"{100 * share:.1f} %", limit, abs(share - 0.95) <= slack)


def spread(studies: Sequence[StudyFound], people: int) -> float:
    """Return the standard deviation of ln threshold over studies of so many participants."""
    return float(np.std([math.log(found.mean_of(people)) for found in studies], ddof=1))


def evidence(judged: Sequence[Verdict], heading: str) -> Evidence:
    """Return a row for each value, with its limit, as Markdown below a heading and as CSV."""
    names = ("study", "what", "value", "limit", "holds")
    rows = [(one.study, one.what, one.value, one.limit, one.holds) for one in judged]
    table = Table(names, [(*row, "yes" if holds else "no") for *row, holds in rows], left=5)
    csv = Table(names, [(*row, str(holds).lower()) for *row, holds in rows]).csv()
    text = f"{heading}\n\n{table.markdown()}\n"
    beyond = any(not one.holds for one in judged)
    return Evidence(text, {"thresholds.md": text, "thresholds.csv": csv}, missed=beyond)
