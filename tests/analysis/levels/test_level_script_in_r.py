"""The report's script in R computes d′, criterion and exponents of the power law again."""

import csv
import re
import shutil
from pathlib import Path

import pytest

from tests.analysis.report.read_report import numbers, run_in_r

pytestmark = pytest.mark.slow
LINE = re.compile(r"(.+?) +report +(\S+) +R +(\S+)")


def numbers_from_r(stdout: str) -> dict[str, float]:
    return {match[1]: float(match[3]) for line in stdout.splitlines() if (match := LINE.match(line))}


def test_r_computes_the_same_numbers(reported_adaptive: Path) -> None:
    process = run_in_r(reported_adaptive)
    assert (process.returncode, process.stderr) == (0, "")
    assert process.stdout.splitlines()[-1] == "all numbers that R computed agree with the report"
    staircase, _ = numbers(reported_adaptive)["results"]["levels"]
    theirs = numbers_from_r(process.stdout)
    for sensitivity in staircase["sensitivities"]:
        if sensitivity["participant"] is not None:
            what = f"staircase, {sensitivity['participant']} at {sensitivity['standard']:.1f}:"
            assert theirs[f"{what} d'"] == pytest.approx(sensitivity["d_prime"], rel=1e-5)
            assert theirs[f"{what} criterion"] == pytest.approx(sensitivity["criterion"], rel=1e-5, abs=1e-6)


@pytest.mark.nightly
def test_r_reads_a_study_of_every_reply(reported_levels: Path) -> None:
    process = run_in_r(reported_levels)
    assert (process.returncode, process.stderr) == (0, "")
    theirs = numbers_from_r(process.stdout)
    assert {"pairs, P001 with late: d'", "number, P001: exponent"} <= set(theirs)


def test_r_finds_a_criterion_that_was_changed(reported_adaptive: Path, tmp_path: Path) -> None:
    for path in (*reported_adaptive.glob("*.csv"), reported_adaptive / "report.R"):
        shutil.copy(path, tmp_path)
    (path,) = tmp_path.glob("*_description-thresholds_data.csv")
    with path.open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    place = head.index("criterion")
    changed = next(row for row in rows if row[place] != "n/a")
    changed[place] = str(float(changed[place]) + 1)
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([head, *rows])
    process = run_in_r(tmp_path)
    assert process.returncode == 1
    assert "numbers that differ: 1" in process.stdout
