"""Four studies whose reports are recomputed from their tables by code that shares nothing with the program."""

import json
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from study_app.analysis import contrasts
from study_app.analysis.data import motion, study_tables
from study_app.analysis.findings import delays, finding
from study_app.analysis.statistics import rank_tests, trend_tests
from study_app.psychophysics import detection
from tests.analysis.oracle import studies
from tests.analysis.oracle.recomputed import read_csv
from tests.analysis.oracle.studies import MEASURED, ROOT, Written, write
from tests.studies import once

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]

STUDIES = {"rek2024": studies.statements, "levels": studies.levels, "groups": studies.groups, "sites": studies.sites}
RECOMPUTED = 0.92
"""Least share of the numbers of a report."""
THRESHOLDS, PROPERTIES = "tests/analysis/levels/test_thresholds.py::", "tests/analysis/oracle/test_properties.py::"
PROVED = {
    r"format|results\.seed|results\.decided\..*|results\.contrasts\.contrast\.bound": "given, not computed",
    r"sessions\.(session|seed)|exclusions\..*|results\.levels\.published\..*": "given, not computed",
    r"sessions\.trials_missing": "tests/store/test_missing_trials.py::",
    r"results\.performance\.(trials|recorded)": "tests/analysis/tables/test_own_dynamics.py::"
    "test_reaches_are_those_of_the_session_and_missing_recordings_are_reported",
    r"results\.orders\..*": "tests/protocol/orders/test_balance.py::test_positions_and_successions_are_counted",
    r"results\.scores\..*": "tests/protocol/instruments/test_instruments.py::test_published_and_worked_scores",
    r".*\.p_skewed": "tests/analysis/statistics/test_mean_tests.py::"
    "test_the_p_for_skewness_is_that_of_halls_transformation",
    r".*\.p_bootstrap": PROPERTIES + "test_p_of_the_bootstrap_is_that_of_other_draws",
    r"results\.contrasts\.p_equivalent": "tests/analysis/test_contrasts.py::"
    "test_equality_is_corrected_over_the_hypotheses_that_state_a_bound",
    r"results\.contrasts\.ordinal\..*": "tests/analysis/statistics/test_effect_sizes.py::test_delta_is_counted",
    r"results\.blocks\.overall\.p": PROPERTIES + "test_p_over_all_statements_is_that_of_other_draws",
    r"results\.blocks\.(trends\.outcome|named\.found)\.interval\..*": PROPERTIES
    + "test_intervals_of_resampled_people_are_those_of_other_draws",
    r"results\.blocks\.threshold\..*": PROPERTIES + "test_the_detection_threshold_is_that_of_the_people",
    r"results\.levels\.thresholds\.fit_p": "tests/analysis/statistics/psychometrics/test_threshold.py::"
    "test_p_of_fit_is_uniform_where_the_function_is_true",
    r"results\.levels\.thresholds\.reversal_mean": "tests/psychophysics/test_grid.py::"
    "test_percent_correct_at_the_mean_of_reversals_in_the_long_run",
    r"results\.levels\.thresholds\.target_percent": "tests/psychophysics/test_grid.py::"
    "test_percent_correct_at_the_mean_of_reversals_in_the_long_run",
    r"results\.levels\.thresholds\.error_bursts": THRESHOLDS + "test_clusters_are_weighted_by_the_answers_just_before",
    r"results\.levels\.thresholds\.if_many_lapses": "tests/analysis/statistics/psychometrics/test_people.py::"
    "test_the_threshold_for_many_lapses_is_unbiased_for_frequent_lapses",
    r"results\.levels\.thresholds\.compared.*": THRESHOLDS
    + "test_thresholds_are_compared_with_published_ones_at_their_percentage",
}
"""The names of the numbers that are not recomputed, and what proves them: a test, or why there is nothing to prove."""


@pytest.fixture(scope="module")
def written_report(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Written]:
    """Return the study of a name with its report."""

    def make(name: str) -> Written:
        def fill(folder: Path) -> None:
            write(name, STUDIES[name](folder), folder / "report", figures=name != "levels")

        folder = once(tmp_path_factory, f"oracle-{name}", fill)
        return Written(folder / "study", folder / "report", studies.FILES[name])

    return make


@pytest.mark.parametrize("name", STUDIES)
def test_every_recomputed_number_agrees_and_most_numbers_are_recomputed(
    name: str, written_report: Callable[[str], Written]
) -> None:
    compared = written_report(name).compared()
    missing = Counter(re.sub(r"\.\d+", "", place) for place in compared.numbers.keys() - compared.places)
    share = 1 - missing.total() / len(compared.numbers)
    lines = [f"{name}: {100 * share:.1f} % of {len(compared.numbers)} numbers were recomputed; these were not:"]
    for number, count in missing.most_common():
        proved = [proof for pattern, proof in PROVED.items() if re.fullmatch(pattern, number)]
        lines.append(f"{count:6d} {number}: {', '.join(proved) or 'NOT PROVED'}")
    print("\n".join(lines))  # noqa: T201 - pytest shows it with -s, or if the test fails
    assert compared.differences == []
    assert share >= RECOMPUTED
    assert not [line for line in lines if line.endswith("NOT PROVED")]


@pytest.mark.parametrize("proof", sorted({proof for proof in PROVED.values() if "::" in proof}))
def test_the_tests_that_prove_the_other_numbers_exist(proof: str) -> None:
    file, _, name = proof.partition("::")
    assert f"def {name or 'test_'}" in (ROOT / file).read_text("utf-8")


@pytest.mark.parametrize("name", STUDIES)
def test_measured_columns_have_different_values(name: str, written_report: Callable[[str], Written]) -> None:
    for path in written_report(name).study.rglob("*_data.csv"):
        table = read_csv(path)
        for column in table.columns.intersection([column for column, kind in MEASURED.items() if kind != "flag"]):
            values = table[column].dropna()
            assert values.is_unique, f"{path.name}: {column}"


@pytest.mark.variants(2)
@pytest.mark.parametrize(
    "path",
    [
        ("blocks", 0, "measures", 3, "q1"),
        ("blocks", 1, "against", 2, "found", "p_upper"),
        ("blocks", 1, "against", 2, "found", "interval", "low"),
        ("performance", "moved", 4, "median"),
    ],
)
def test_a_number_that_is_off_by_a_thousandth_is_found(
    written_report: Callable[[str], Written], tmp_path: Path, path: tuple[str | int, ...]
) -> None:
    of_study = written_report("rek2024")
    for file in of_study.report.iterdir():
        (tmp_path / file.name).symlink_to(file)
    report = tmp_path / "report.json"
    changed = json.loads(report.read_text("utf-8"))
    part = changed["results"]
    for key in path[:-1]:
        part = part[key]
    part[path[-1]] += 1e-3 * max(1.0, abs(part[path[-1]]))
    report.unlink()
    report.write_text(json.dumps(changed), encoding="utf-8", newline="\n")
    differences = replace(of_study, report=tmp_path).compared().differences
    assert [place for place, _, _ in differences] == ["results." + ".".join(map(str, path))]


Planted = tuple[str, Callable[[pytest.MonkeyPatch], None], str]
"""A study, what plants a fault in the program, and where the oracle finds it."""


def quartile_as_median(patched: pytest.MonkeyPatch) -> None:
    def swapped(values: Any, of: Callable[[Any], Any] = motion.quartiles_or_none) -> Any:
        return of(values)._replace(median=of(values).q1)

    patched.setattr(motion, "quartiles_or_none", swapped)


def control_exchanged_with_delay(patched: pytest.MonkeyPatch) -> None:
    def negated(differences: Any, *bound: Any, of: Callable[..., Any] = delays.tost, **more: Any) -> Any:
        return of(-differences, *bound, **more)

    patched.setattr(delays, "tost", negated)


def conditions_exchanged(patched: pytest.MonkeyPatch) -> None:
    of = contrasts._participant_values

    def swapped(study: Any, contrast: Any, block: str, condition: Any, *rest: Any) -> Any:
        others = [other for other in contrast.conditions or () if other != condition] or [condition]
        return of(study, contrast, block, others[0], *rest)

    patched.setattr(contrasts, "_participant_values", swapped)


def exclusions_forgotten(patched: pytest.MonkeyPatch) -> None:
    of = study_tables.mark_excluded
    patched.setattr(study_tables, "mark_excluded", lambda table, _listed: of(table, ()))


def excluded_trials_forgotten(patched: pytest.MonkeyPatch) -> None:
    of = study_tables.mark_excluded

    def of_sessions(table: Any, listed: Any) -> Any:
        return of(table, [exclusion for exclusion in listed if exclusion.trial is None])

    patched.setattr(study_tables, "mark_excluded", of_sessions)


def withdrawn_sessions_counted(patched: pytest.MonkeyPatch) -> None:
    patched.setattr(study_tables, "REACHED_END", ("completed", "incomplete", "withdrawn"))


def p_of_pairs_one_sided(patched: pytest.MonkeyPatch) -> None:
    patched.setattr(rank_tests, "signed_p", partial(rank_tests.signed_p, alternative="greater"))


def p_of_trends_two_sided(patched: pytest.MonkeyPatch) -> None:
    patched.setattr(trend_tests, "signed_p", lambda ranks, v, _side: rank_tests.signed_p(ranks, v))


def p_of_hypotheses_one_sided(patched: pytest.MonkeyPatch) -> None:
    patched.setitem(contrasts.SIDES, None, "greater")  # type: ignore[arg-type]


def rates_of_false_discovery_for_primary_statements(patched: pytest.MonkeyPatch) -> None:
    patched.setattr(finding, "holm", finding.false_discovery)


def first_answer_for_the_median(patched: pytest.MonkeyPatch) -> None:
    patched.setattr(finding, "medians", lambda values: values[..., 0])


def d_prime_of_one_interval(patched: pytest.MonkeyPatch) -> None:
    patched.setattr(detection, "two_intervals", detection.yes_no)


FAULTS: tuple[Planted, ...] = (
    ("rek2024", quartile_as_median, r"results\.performance\.moved\.\d+\.median|motion\.csv \d+ median"),
    ("rek2024", control_exchanged_with_delay, r"results\.blocks\.1\.against\.\d+\.found\.effect"),
    ("rek2024", p_of_trends_two_sided, r"results\.blocks\.1\.trends\.\d+\.outcome\.p"),
    ("rek2024", rates_of_false_discovery_for_primary_statements, r"results\.blocks\.0\.omnibus\.\d+\.p_adjusted"),
    ("groups", conditions_exchanged, r"results\.contrasts\.0\.effect"),
    ("groups", exclusions_forgotten, r"study\.participants"),
    ("groups", excluded_trials_forgotten, r"results\.blocks\.1\.measures\.\d+\.n"),
    ("groups", withdrawn_sessions_counted, r"study\.participants"),
    ("groups", p_of_pairs_one_sided, r"results\.blocks\.0\.pairs\.\d+\.tested\.outcome\.p"),
    ("groups", p_of_hypotheses_one_sided, r"results\.contrasts\.1\.p"),
    ("groups", first_answer_for_the_median, r"results\.blocks\.0\.effects\.\d+\.mean"),
    ("levels", d_prime_of_one_interval, r"results\.levels\.0\.sensitivities\.\d+\.d_prime"),
)


@pytest.mark.variants(4)
@pytest.mark.parametrize(("name", "plant", "where"), FAULTS, ids=[plant.__name__ for _, plant, _ in FAULTS])
def test_a_planted_fault_is_found(
    name: str,
    plant: Callable[[pytest.MonkeyPatch], None],
    where: str,
    written_report: Callable[[str], Written],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plant(monkeypatch)
    differences = write(name, written_report(name).study, tmp_path / "report").compared().differences
    for pattern in where.split("|"):
        assert [place for place, _, _ in differences if re.fullmatch(pattern, place)], differences[:9]
