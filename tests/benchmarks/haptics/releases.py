"""Releases of a handle without friction with "kalman": how many keep oscillating.

Run it by itself: ``python tests/benchmarks/haptics/releases.py CASES``.
"""

import dataclasses
import itertools
import sys
from concurrent.futures import ProcessPoolExecutor
from random import Random

from study_app.evidence.stability.stability_cases import FIRST, LETS_GO, REACHES, SECOND, SINE, STROKE, Case
from study_app.evidence.stability.verdict import judge

LIQUIDS = ("honey", "light_oil", "dense", "physical_honey", "physical_glycerin", "physical_water")
CHOICES = {
    "liquid": (*LIQUIDS, *["physical_tar"] * 4),
    "scale": (1.0, 1.0, 3.0),
    "delay": ((2, 1), (2, 1), (3, 2), (1, 0), (1, 1), (2, 2)),  # in fact, and as assumed
    "motion": (STROKE, REACHES, SINE),
    "speed_mps": (0.3, 0.6, 1.0),
    "mass_kg": (0.1, 0.15, 0.2, 0.25, 0.3, 0.4),
    "release_s": (0.6, 0.65, 0.7, 0.75, 0.8, 0.9),
    "plant": (FIRST, SECOND),
}


def cases(count: int) -> list[Case]:
    """Return cases that are drawn from all combinations, the same in every run."""
    drawn = Random(5).sample(list(itertools.product(*CHOICES.values())), count)  # noqa: S311 - no secret
    named = (dict(zip(CHOICES, values, strict=True)) for values in drawn)
    free = Case(hand=LETS_GO, estimator="kalman", viscous_nspm=0.0)
    return [
        dataclasses.replace(free, **case, delay=delay, believed=believed)
        for case in named
        for delay, believed in [case.pop("delay")]
    ]


def reasons(case: Case) -> tuple[str, ...]:
    """Return why a case is unstable."""
    return judge(case, safe=True).reasons


def main() -> None:
    """Print how many cases are unstable, and how many of them oscillate."""
    count = int(sys.argv[1])
    with ProcessPoolExecutor() as executor:
        unstable = [*filter(None, executor.map(reasons, cases(count), chunksize=8))]
    oscillating = sum("oscillation" in case_reasons for case_reasons in unstable)
    print(f"of {count} cases {len(unstable)} unstable, {oscillating} oscillate")


if __name__ == "__main__":
    main()
