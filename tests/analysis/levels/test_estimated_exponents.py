"""Exponents of magnitude estimation: slopes of mean ln answers on ln levels, in report, table and R."""

import csv
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from study_app.analysis.designs.estimated_exponents import estimated_exponents
from study_app.analysis.designs.level_summaries import levels_found
from study_app.analysis.designs.weber_exponents import weber_exponents
from study_app.analysis.export.export import export
from study_app.analysis.report.answers import level_section
from study_app.analysis.report.answers.level_methods import level_methods
from study_app.analysis.report.findings_summary import level_findings
from study_app.analysis.report.write_report import report
from study_app.analysis.results.level_results import ThresholdFound
from study_app.analysis.tables.study_tables import load_study
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.blinded.unblinding import unblind
from study_app.store.tables.column import header
from study_app.store.tables.level_columns import EXPONENTS
from tests.analysis.levels.test_sensitivities import block
from tests.analysis.report.read_report import numbers, run_in_r

LEVELS = (0.5, 2.0, 8.0)


def rows(exponents: dict[str, float], units: dict[str, float], delivered: float = 1.0) -> pd.DataFrame:
    """Return two answers to each level of participants without noise; 1.2 and 1/1.2 of what they name on average."""
    held = [
        (person, "b", level, delivered * level, True, each * units[person] * (delivered * level) ** exponent)
        for person, exponent in exponents.items()
        for level in LEVELS
        for each in (1.2, 1 / 1.2)
    ]
    frame = pd.DataFrame(held, columns=["participant", "block", "level", "level_delivered", "analysed", "value"])
    return frame.astype({"level_delivered": "Float64", "value": "Float64"})


def test_planted_exponents_are_found_whatever_unit_a_participant_chose() -> None:
    planted, units = {"P001": 0.44, "P002": 0.6}, {"P001": 10.0, "P002": 300.0}
    group, *own = estimated_exponents(replace(block("estimation"), id="b"), rows(planted, units))
    assert [one.exponent for one in own] == pytest.approx([0.44, 0.6], abs=1e-12)
    assert [(one.participant, one.n) for one in own] == [("P001", 3), ("P002", 3)]
    assert (group.participant, group.n, group.exponent) == (None, 2, pytest.approx(0.52))
    half = stats.t.ppf(0.975, 1) * np.std([0.44, 0.6], ddof=1) / math.sqrt(2)
    assert (group.low, group.high) == (pytest.approx(0.52 - half), pytest.approx(0.52 + half))


def test_the_slope_is_over_delivered_levels() -> None:
    frame = rows({"P001": 0.5}, {"P001": 1.0})
    frame.loc[frame["level"] == 8.0, "level_delivered"] = [6.0, 10.0]  # on average 8
    frame.loc[frame["level"] == 2.0, "level_delivered"] = pd.NA  # not measured: as requested
    _, one = estimated_exponents(replace(block("estimation"), id="b"), frame)
    assert one.exponent == pytest.approx(0.5, abs=1e-12)
    frame["level_delivered"] = frame["level_delivered"] ** 2
    _, one = estimated_exponents(replace(block("estimation"), id="b"), frame)
    assert one.exponent != pytest.approx(0.5, abs=0.01)


def test_choices_modulus_trials_and_a_single_level_have_no_exponent() -> None:
    frame = rows({"P001": 0.5}, {"P001": 1.0})
    assert list(estimated_exponents(replace(block("2ifc"), id="b"), frame)) == []
    asked = replace(block("estimation"), id="b")
    assert list(estimated_exponents(asked, frame.assign(analysed=False))) == []
    assert list(estimated_exponents(asked, frame[frame["level"] == 2.0])) == []


@pytest.fixture(scope="module")
def thickness(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return `thickness` with three simulated participants whose numbers follow the square root of the viscosity."""
    folder = tmp_path_factory.mktemp("thickness") / "study"
    rehearse_answers("thickness", participants=3, seed=1, results=folder, felt={})
    assert unblind(folder, "AB", "to analyse").left == ()
    return folder


@pytest.mark.slow
def test_the_report_states_the_exponent_the_published_one_and_the_method(thickness: Path) -> None:
    study = load_study(thickness)
    (found,) = levels_found(study)
    group, *own = found.exponents
    assert len(own) == group.n == 3
    assert 0.45 < group.exponent < 0.55  # answers without a servo follow the square root of the viscosity itself
    page = "".join(level_section.section(found, (), None))
    assert "Exponent of the power law" in page
    assert "Published: Stevens &amp; Guirao 1964, Science 144, 1157: exponent 0.44 (0.42 to 0.46)." in page
    assert "leaves out that each participant chose a unit" in page
    sentence, published = level_findings(found)
    assert sentence.startswith(f"{found.title}: exponent of the power law {group.exponent:.2f} (95 % interval")
    assert sentence.endswith("; three participants) over viscosity.")
    assert "exponent 0.44" in published
    assert "The exponent of magnitude estimation (Stevens 1957)" in " ".join(level_methods(study.levels, [found]))


@pytest.mark.slow
def test_the_export_has_the_exponents_of_the_report(thickness: Path, tmp_path: Path) -> None:
    files = export(thickness, tmp_path, extras={"sav", "parquet"})
    with (tmp_path / "study-thickness_description-exponents_data.csv").open(newline="", encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    (found,) = levels_found(load_study(thickness))
    assert [(row["participant"], row["block"], int(row["levels"]), float(row["exponent"])) for row in table] == [
        (one.participant, "thickness", one.n, pytest.approx(one.exponent, rel=1e-12)) for one in found.exponents[1:]
    ]
    assert list(table[0])[5:] == list(header(EXPONENTS))
    assert {path.suffix for path in files if "exponents" in path.name} == {".csv", ".sav", ".parquet"}
    assert not [path for path in files if "settings" in path.name]


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.usefixtures("figures_of_the_page")
def test_r_computes_the_same_exponents(thickness: Path, tmp_path: Path) -> None:
    report(thickness, tmp_path)
    done = run_in_r(tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    (found,) = numbers(tmp_path)["results"]["levels"]
    said = dict(re.findall(r"(.+?) +report +\S+ +R +(\S+)", done.stdout))
    assert len(found["exponents"]) == 4
    for one in found["exponents"]:
        who = "group" if one["participant"] is None else one["participant"]
        assert float(said[f"thickness, {who} exponent of the power law"]) == pytest.approx(one["exponent"], rel=1e-5)
    assert "thickness, group exponent of the power law, low" in said
    script = (tmp_path / "report.R").read_text(encoding="utf-8")
    wrong = script.replace(f"{found['exponents'][1]['exponent']!r})", "0.9)")
    assert wrong != script
    (tmp_path / "report.R").write_text(wrong, encoding="utf-8")
    assert run_in_r(tmp_path).returncode == 1


STANDARDS = (4.0, 8.0, 16.0, 32.0)


def observers(*exponents: float, weber: bool = True) -> list[ThresholdFound]:
    """Return thresholds of observers whose JND is 0.5 standard^exponent."""
    return [
        ThresholdFound(f"P{number:03d}", s, 60, 0.5 * s ** (exponent - weber), None, None)
        for s in STANDARDS
        for number, exponent in enumerate(exponents, start=1)
    ]


@pytest.mark.parametrize("weber", [True, False])
def test_planted_exponents_are_found_for_fractions_and_for_differences(weber: bool) -> None:
    group, *own = weber_exponents(observers(1.0, 0.0, 0.8, weber=weber), "weber" if weber else "difference")
    assert [one.exponent for one in own] == pytest.approx([1.0, 0.0, 0.8], abs=1e-12)
    assert [(one.participant, one.n) for one in own] == [("P001", 4), ("P002", 4), ("P003", 4)]
    assert (group.participant, group.n, group.exponent) == (None, 3, pytest.approx(0.6))
    low, high = stats.ttest_1samp([1.0, 0.0, 0.8], 0.0).confidence_interval(0.95)
    assert (group.low, group.high) == pytest.approx((low, high))


def test_one_standard_and_values_have_no_exponent() -> None:
    one = [threshold for threshold in observers(1.0, 1.0) if threshold.standard == 4.0]
    assert list(weber_exponents(one, "weber")) == []
    assert list(weber_exponents(observers(1.0), "value")) == []
    detection = [replace(threshold, standard=0.0) for threshold in one]
    assert list(weber_exponents([*one, *detection], "difference")) == []


def test_the_exponent_of_one_participant_has_no_interval() -> None:
    group, own = weber_exponents(observers(1.0), "weber")
    assert (group.n, group.low, group.high) == (1, None, None)
    assert own.participant == "P001"
