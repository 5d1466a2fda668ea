"""The report's script in R computes d′, criterion and exponents of the power law again."""

import csv
import re
import shutil
from pathlib import Path

import pytest

from tests.analysis.report.read_report import numbers, run_in_r

pytestmark = pytest.mark.slow
LINE = re.compile(r"(.+?) +report +(\S+) +R +(\S+)")


def computed(stdout: str) -> dict[str, float]:
    return {found[1]: float(found[3]) for line in stdout.splitlines() if (found := LINE.match(line))}


def test_r_computes_the_same_numbers(reported_adaptive: Path) -> None:
    done = run_in_r(reported_adaptive)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines()[-1] == "all numbers that R computed agree with the report"
    staircase, _ = numbers(reported_adaptive)["results"]["levels"]
    theirs = computed(done.stdout)
    for one in staircase["sensitivities"]:
        if one["participant"] is not None:
            what = f"staircase, {one['participant']} at {one['standard']:.1f}:"
            assert theirs[f"{what} d'"] == pytest.approx(one["d_prime"], rel=1e-5)
            assert theirs[f"{what} criterion"] == pytest.approx(one["criterion"], rel=1e-5, abs=1e-6)


@pytest.mark.nightly
def test_r_reads_a_study_of_every_reply(reported_levels: Path) -> None:
    done = run_in_r(reported_levels)
    assert (done.returncode, done.stderr) == (0, "")
    theirs = computed(done.stdout)
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
    done = run_in_r(tmp_path)
    assert done.returncode == 1
    assert "numbers that differ: 1" in done.stdout
