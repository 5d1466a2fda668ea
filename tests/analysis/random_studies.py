"""Random studies of any kind, and what every finding must keep to in any study: no exception, no NaN, no template."""

import json
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from study_app.analysis.data.study_tables import Study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.findings import all_findings
from study_app.analysis.page_layout import draw_figures
from study_app.analysis.report import sections
from study_app.analysis.report.first_page import first_page
from study_app.analysis.report.methods import methods
from study_app.analysis.report.sections import answers, block
from study_app.analysis.report.study_figures import block_figure_tasks
from study_app.analysis.report.write_report import as_json_types, tests_csv
from study_app.analysis.results import Failures, Results
from tests.analysis.made_up import DECIDED, ITEMS, Presented, delays, liquids, study
from tests.analysis.report.read_report import FORBIDDEN, seen


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
                    answers_of_person = [None if rng.random() < missing else int(min(7, value)) for value in wanted]
                    trials.append((f"P{person:03d}", session, setting.code, answers_of_person))
    is_decided = rng.random() < 0.8
    bound = float(rng.choice([0.5, 1.0, 3.0]))
    decided = replace(
        DECIDED, made=is_decided, changed=bool(rng.random() < 0.2), equivalence_bound=bound if is_decided else None
    )
    decided = replace(decided, alpha=float(rng.choice([0.05, 0.05, 0.001])), primary=ITEMS[: int(rng.integers(0, 3))])
    return study(settings, trials, decided)


def keeps_contract(made: Study, forms: Sequence[str] = ()) -> Results:
    """Evaluate a study, write its texts and draw its figures in these formats; return the results.

    Each finding has a value only in blocks that it is about, and only codes to speak of while the key is sealed.
    """
    results = evaluate(made)
    assert results.failures == ()
    json.dumps(as_json_types(results), allow_nan=False)
    failures = Failures()
    figures = list(draw_figures(block_figure_tasks(made, results, forms), failures)) if forms else []
    texts = [methods(made, results), *sections.limits(made, results)]
    page = first_page(results, sections.limits(made, results))
    texts.append(seen(re.sub(r'src="[^"]*"', 'src="#part-"', page)))
    for block_result in results.blocks:
        section = " ".join(block(block_result, results, figures, failures))
        texts.append(seen(re.sub(r'src="[^"]*"', 'src="#part-"', section)))
        for finding in all_findings():
            if block_result.kind not in (finding.kinds if block_result.revealed else finding.sealed):
                assert finding.value_in(block_result) == finding.empty, finding.key
            here = finding(block_result, results)
            statements = [*here.limits(), *here.methods()]
            assert all(text.endswith(".") for text in statements), finding.key
            assert all(row["block"] == block_result.id for row in here.rows()), finding.key
    questions = [(answer.block, answer.question) for answer in answers(results)]
    assert len(set(questions)) == len(questions)
    assert failures.found == []
    for picture in figures:
        assert picture.caption.endswith(".")
        assert all(picture.files[form] for form in forms)
        texts.append(picture.caption)
    for text in texts:
        assert (wrong := FORBIDDEN.search(text)) is None, text[max(0, wrong.start() - 80) : wrong.end() + 40]
    assert tests_csv(results)
    return results
