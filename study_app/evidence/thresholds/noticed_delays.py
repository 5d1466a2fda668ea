"""The delay that people rate as noticed, and the one that they detect: the same simulated people in both procedures.

A delay reaches a person with Gaussian noise, whose spread follows from the person's just-noticeable difference. In
``delaydetect`` the person chooses the interval that seems more delayed. In ``rek2024`` the person rates the statement
``different`` after each delay: the noisy delay is compared with a criterion of the person's own, as in the answer model
of rehearsals. Both sets of answers are analysed as in the report.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from study_app.analysis.statistics.thresholds import Threshold, noticed
from study_app.evidence.thresholds.methods_alone import simulate
from study_app.evidence.thresholds.planted import planted
from study_app.protocol.load import load
from study_app.protocol.model import Protocol
from study_app.protocol.simulated_observer import NO_FEATURES, Draw, Rater, rate, rater
from study_app.protocol.streams import stream
from study_app.session.simulated.participant import Observer

JND_S: Final = 0.045
"""Of a delay, at 75 % correct in two intervals (Vogels 2004)."""
BETWEEN_PEOPLE: Final = 1.2
MEAN_CRITERION_S: Final = 0.13
"""Of the answer model, which was chosen to agree with the thesis."""
CRITERIA_S: Final = (0.06, 0.095, MEAN_CRITERION_S, 0.165)
ADAPTED_S: Final = 0.03
"""How far earlier delays have moved the delay that seems to be none."""
STATEMENT: Final = "different"
LIKERT, FORCED_CHOICE = "rek2024", "delaydetect"


@dataclass(frozen=True, slots=True)
class Person:
    """Someone who takes part in both procedures.

    Attributes
    ----------
    observer : Observer
        What is discriminated; its ``delay_noise_s`` is the spread of a delay as it is perceived.
    rater : Rater
        How statements are rated; its ``threshold_s`` is the criterion.
    """

    observer: Observer
    rater: Rater


@dataclass(frozen=True, slots=True)
class Rated:
    """The ratings of all people under one mean criterion.

    Attributes
    ----------
    criterion_s : float
        Mean criterion of the people [s].
    adapted_s : float
        How far the delay that seems to be none has moved [s].
    found : Threshold
        The delay at which half of the ratings agree, as in the report.
    """

    criterion_s: float
    adapted_s: float
    found: Threshold


@dataclass(frozen=True, slots=True)
class Compared:
    """What both procedures find of the same people.

    Attributes
    ----------
    detected_ms : tuple of float
        Threshold of the group in the forced choice, low and high [ms].
    rated : tuple of Rated
        The ratings, by criterion; the last one after adaptation.
    """

    people: int
    seed: int
    detected_ms: tuple[float, float, float]
    rated: tuple[Rated, ...]


def people_of(count: int, seed: int) -> tuple[Person, ...]:
    """Return people whose just-noticeable differences differ by a factor of 1.2."""
    found = []
    for number in range(1, count + 1):
        draw = stream(seed, f"noticed/person/{number}").random
        jnd_s = JND_S * BETWEEN_PEOPLE ** _normal(draw)
        found.append(Person(Observer(delay_jnd_s=jnd_s), rater(draw)))
    return tuple(found)


def compare(count: int, seed: int) -> Compared:
    """Return what ``count`` people, three or more, detect and rate as noticed."""
    people = people_of(count, seed)
    both = [(criterion_s, 0.0) for criterion_s in CRITERIA_S] + [(MEAN_CRITERION_S, ADAPTED_S)]
    return Compared(count, seed, detected(people, seed), tuple(rated(people, *one, seed) for one in both))


def detected(people: Sequence[Person], seed: int) -> tuple[float, float, float]:
    """Return the group's threshold in `FORCED_CHOICE` with the ends of its 95 % interval [ms]."""
    one = planted(FORCED_CHOICE, load(FORCED_CHOICE))
    (group,) = simulate(one, 0, seed, observers=[person.observer for person in people]).group
    return group


def rated(people: Sequence[Person], criterion_s: float, adapted_s: float, seed: int) -> Rated:
    """Return the delay from which people agree that it is different, in `LIKERT`.

    Parameters
    ----------
    criterion_s : float
        Mean criterion [s]; people keep their distances from the mean.
    adapted_s : float
        How far the delay that seems to be none has moved [s].
    seed : int
        Of all randomness; the same noise for every criterion.
    """
    delays_ms = delays_of(load(LIKERT))
    answers = []
    for number, person in enumerate(people, start=1):
        draw = stream(seed, f"noticed/ratings/{number}").random
        own = replace(person.rater, threshold_s=person.rater.threshold_s - MEAN_CRITERION_S + criterion_s)
        answers.append([_rating(replace(person, rater=own), ms / 1000 - adapted_s, draw) for ms in delays_ms])
    return Rated(criterion_s, adapted_s, noticed(np.array(answers, float), delays_ms))


def delays_of(protocol: Protocol) -> tuple[float, ...]:
    """Return the delays of the block whose statements ask for them, ascending [ms]."""
    (block,) = (one for one in protocol.main_blocks if protocol.compared_in(one.id) == "delays")
    return tuple(sorted(protocol.conditions[name].delay_ms for name in block.conditions))


def _rating(person: Person, delay_s: float, draw: Draw) -> int:
    perceived_s = delay_s + person.observer.delay_noise_s * _normal(draw)
    return rate([STATEMENT], replace(NO_FEATURES, delay_s=perceived_s), person.rater, draw)[STATEMENT]


def _normal(draw: Draw) -> float:
    return sum(draw() for _ in range(12)) - 6


def markdown(found: Compared) -> str:
    """Return both thresholds as a table."""
    return "\n".join(_lines(found)) + "\n"


def _lines(found: Compared) -> Iterator[str]:
    yield f"**SIMULATED.** The same {found.people} people in both procedures, seed {found.seed}."
    yield ""
    yield "| procedure | criterion | threshold | 95 % interval |"
    yield "|---|---:|---:|---:|"
    middle, low, high = found.detected_ms
    yield f"| {FORCED_CHOICE}: forced choice, 75 % correct | – | {middle:.0f} ms | {low:.0f} to {high:.0f} ms |"
    for one in found.rated:
        adapted = f", adapted to {1000 * one.adapted_s:.0f} ms" if one.adapted_s else ""
        name = f"{LIKERT}: rating of “{STATEMENT}”, half agree{adapted}"
        effect, threshold = one.found.effect, one.found
        value = "none" if effect is None else f"{effect:.0f} ms"
        known = threshold.lower is not None and threshold.upper is not None
        ends = f"{threshold.lower:.0f} to {threshold.upper:.0f} ms" if known else "–"
        yield f"| {name} | {1000 * one.criterion_s:.0f} ms | {value} | {ends} |"
