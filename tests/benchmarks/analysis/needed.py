"""Whether a finding shows in 80 % of studies of the size that ``power`` says it takes, by the report's own tests.

Run it by itself: ``python tests/benchmarks/analysis/needed.py [STUDIES] [SIZE …]``. ``power`` plans rek2024 for the
sizes and typical people; then so many other studies of each size that it names are answered and reported. Exit code 3
if less than 80 % of them show a statement, but for chance.
"""

import sys
from collections import Counter
from concurrent.futures import Executor, Future
from typing import Any

import numpy as np

from study_app.analysis.findings.finding import FOUND
from study_app.analysis.findings.statement_tests import DelayTrend, SettingsDiffer
from study_app.analysis.planning import WANTED
from study_app.analysis.planning.power_curves import interval, powers
from study_app.analysis.planning.simulated_studies import draw_opinions, plan, sweep
from study_app.analysis.results import Failures
from study_app.evidence.report_rates.simulation import report
from study_app.protocol.load import load
from study_app.protocol.participants.raters import PUBLISHED, TYPICAL
from study_app.session.simulated.rehearsal import condition_features

SEED, OTHER = 1, 2


class Here(Executor):
    """Computes in this process."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Compute the task immediately."""
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


def main(studies: str = "200", *sizes: str) -> int:
    """Print for each statement the size by ``power`` and the rate of other studies that show it; return the code."""
    protocol = load("rek2024")
    planned, study_count = plan(protocol, condition_features(protocol, seed=SEED)), int(studies)
    tried = tuple(map(int, sizes)) or (5, 8, 12, 16, 20, 24)
    *_, (finished_studies, counts) = sweep(planned, tried, study_count, SEED, Here())
    curves = [
        curve
        for curve in powers(planned, tried, finished_studies, study_count, SEED, counts).curves
        if curve.item is not None
    ]
    wanted = {(curve.block, curve.item): (n, curve.power[tried.index(n)]) for curve in curves
              if curve.question in ("conditions differ", "trend") and (n := curve.needed(tried))}  # fmt: skip
    times_shown: Counter[tuple[int, str, str | None]] = Counter()
    for n in sorted({n for n, _ in wanted.values()}):
        for study in range(study_count):
            ratings = [
                np.asarray(opinion.answers(1.0, PUBLISHED[TYPICAL]))
                for opinion in draw_opinions(planned, n, OTHER, study)
            ]
            _, results = report(planned, planned.decided, ratings, study, Failures())
            for block, result in zip(planned.blocks, results, strict=True):
                tests = (*SettingsDiffer.value_in(result), *DelayTrend.value_in(result))
                times_shown.update((n, block.id, test.item) for test in tests if test.verdict in FOUND)
    print("block, statement         n   power %   shown in %  [Wilson]")
    failed = False
    for (block, item), (n, power) in wanted.items():
        share = times_shown[n, block, item] / study_count
        low, high = interval(share, study_count)
        failed |= high < WANTED
        ends = f"[{100 * low:.1f}, {100 * high:.1f}]"
        print(f"{block}, {item:16s} {n:4d} {100 * power:8.1f} {100 * share:11.1f}  {ends}")
    return 3 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
