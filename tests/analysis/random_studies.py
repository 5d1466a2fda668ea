"""Random studies of any kind, and the check that their evaluation and texts hold no exception and no NaN."""

import json
import re
from dataclasses import replace

import numpy as np

from study_app.analysis.evaluate import evaluate
from study_app.analysis.report import findings_summary, number_files
from study_app.analysis.report.block_section import block
from study_app.analysis.report.first_page.first_page import first_page
from study_app.analysis.report.json_values import plain
from study_app.analysis.report.methods_paragraph import methods
from study_app.analysis.report.r_script import r_script
from study_app.analysis.results.section_failures import Failures
from study_app.analysis.tables.study_tables import Study
from tests.analysis.made_up import DECIDED, ITEMS, Presented, delays, liquids, study


def drawn(rng: np.random.Generator) -> Study:
    """Return a study of any levels, ties, missing answers, people, repetitions and sessions."""
    count = int(rng.integers(1, 8))
    settings = liquids(count) if rng.random() < 0.4 else delays(rng.choice([0, 0, 25, 50, 75, 100, 150, 400], count))
    levels = rng.choice(7, int(rng.integers(1, 8)), replace=False) + 1
    missing, slope = rng.choice([0.0, 0.0, 0.1, 0.6, 1.0]), rng.choice([0.0, 1.0, 3.0])
    trials: list[Presented] = []
    for person in range(int(rng.choice([0, 1, 2, 3, 5, 8, 12, 20]))):
        for session in range(1, int(rng.choice([1, 1, 1, 2, 3])) + 1):
            for _ in range(int(rng.choice([1, 1, 1, 2, 3]))):
                for place, setting in enumerate(settings):
                    if rng.random() < missing / 3:
                        continue
                    wanted = rng.choice(levels, len(ITEMS)) + slope * place
                    given = [None if rng.random() < missing else int(min(7, one)) for one in wanted]
                    trials.append((f"P{person:03d}", session, setting.code, given))
    made = rng.random() < 0.8
    bound = float(rng.choice([0.5, 1.0, 3.0]))
    decided = replace(DECIDED, made=made, changed=bool(rng.random() < 0.2), equivalence_bound=bound if made else None)
    decided = replace(decided, alpha=float(rng.choice([0.05, 0.05, 0.001])), primary=ITEMS[: int(rng.integers(0, 3))])
    return study(settings, trials, decided)


def check(number: int) -> None:
    """Evaluate the random study of this number, and write its texts."""
    made = drawn(np.random.default_rng(number))
    results = evaluate(made, planning=False)
    assert results.failures == (), number
    json.dumps(plain(results), allow_nan=False)
    findings_summary.findings(results)
    methods(made, results)
    r_script(made, results)
    number_files.tests_csv(results)
    failures = Failures()
    page = first_page(results, findings_summary.limits(made, results), failures)
    assert failures.found == [], number
    assert not re.search(r"\bnan\b|\bNone\b|\binf\b", re.sub(r'src="[^"]*"', "", page)), number
    for found in results.blocks:
        page = " ".join(block(found, results, ()))
        assert "Not there: its computation failed" not in page, number
