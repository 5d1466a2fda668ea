"""What is planted in a study, and many simulated studies of it on an executor."""

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from functools import partial
from typing import Final, TypeVar

from study_app.evidence.thresholds.estimated_exponents import (
    PlantedExponent,
    exponent_verdicts,
    planted_exponent,
    simulate_estimates,
    spread_of_exponents,
)
from study_app.evidence.thresholds.methods_alone import simulate
from study_app.evidence.thresholds.planted import SHIPPED, Planted, planted
from study_app.evidence.thresholds.verdicts import Verdict, spread, verdicts
from study_app.evidence.thresholds.whole_pipeline import PEOPLE
from study_app.protocol.model import Protocol

NAMES: Final = (*SHIPPED, "thickness")
"""The shipped studies that are validated."""

Found = TypeVar("Found")


def plant(name: str, protocol: Protocol) -> Planted | PlantedExponent:
    """Return what is planted in a study.

    Raises
    ------
    ValueError
        Nothing can be.
    """
    return planted_exponent(name, protocol) or planted(name, protocol)


def methods_alone(
    one: Planted | PlantedExponent, studies: int, seed: int, executor: Executor, progress: Callable[[int], object]
) -> tuple[list[Verdict], float]:
    """Return the verdicts of many studies of equal observers, and the spread of studies of `PEOPLE`.

    ``progress`` is called with the number of finished studies.
    """

    def counted(of_executor: Iterator[Found]) -> list[Found]:
        found = []
        for study in of_executor:
            found.append(study)
            progress(len(found))
        return found

    if isinstance(one, PlantedExponent):
        exponents = counted(executor.map(partial(simulate_estimates, one, seed=seed), range(studies)))
        return list(exponent_verdicts(one, exponents)), spread_of_exponents(exponents, PEOPLE)
    thresholds = counted(executor.map(partial(simulate, one, seed=seed), range(studies)))
    return list(verdicts(one, thresholds)), spread(thresholds, PEOPLE)
