"""The report's script in R: it has the report's numbers and computes them again."""

import random
import re
import shutil
from pathlib import Path

import pytest

from study_app.analysis.report.write_report import report
from tests.analysis.conftest import Results
from tests.analysis.report.read_report import numbers, run_in_r

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]


def test_the_script_in_r_has_every_number_of_the_report(of_twelve: Path) -> None:
    script = (of_twelve / "report.R").read_text(encoding="utf-8")
    assert 'read.csv(file.path(folder, "study-rek2024_description-responses_data.csv")' in script
    for left, right in ("()", "{}"):
        assert script.count(left) == script.count(right)
    found = numbers(of_twelve)["results"]["blocks"]
    for one in (*found[0]["omnibus"], *found[1]["trends"]):
        assert repr(one["outcome"]["statistic"]) in script
    for one in found[1]["against"]:
        assert repr(one["found"]["p"]) in script


def test_r_computes_the_same_numbers(of_twelve: Path) -> None:
    done = run_in_r(of_twelve)
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    assert lines[-1] == "every number that R computes is the report's"
    told = re.compile(r"(.+?) +report +(\S+) +R +(\S+)")
    computed = {found[1]: float(found[3]) for line in lines if (found := told.match(line))}
    liquids, delays = numbers(of_twelve)["results"]["blocks"]
    for one in liquids["omnibus"]:
        assert computed[f"{one['item']} Friedman chi2"] == pytest.approx(one["outcome"]["statistic"], rel=1e-5)
    for pair in liquids["pairs"]:
        outcome, codes = pair["tested"]["outcome"], f"{pair['first']} and {pair['second']}"
        assert computed[f"{pair['tested']['item']}, {codes} exact p"] == pytest.approx(outcome["p"], rel=1e-5)
    for one in delays["trends"]:
        assert computed[f"{one['item']} Page's L"] == pytest.approx(one["outcome"]["statistic"], rel=1e-5)
        assert computed[f"{one['item']} exact p"] == pytest.approx(one["outcome"]["p"], rel=1e-5)
    for one in delays["against"]:
        what = f"{one['item']}, {one['delay_ms']:g} ms"
        assert computed[f"{what} equivalence p"] == pytest.approx(one["found"]["p"], rel=1e-5)
        assert computed[f"{what} difference p by t"] == pytest.approx(one["found"]["p_different"], rel=1e-5)
    assert computed["liquids right names"] == liquids["named"]["found"]["statistic"]


def test_r_finds_a_number_that_was_changed(of_twelve: Path, tmp_path: Path) -> None:
    for name in ("report.R", "study-rek2024_description-responses_data.csv"):
        shutil.copy(of_twelve / name, tmp_path)
    one = numbers(of_twelve)["results"]["blocks"][1]["trends"][0]["outcome"]
    script = (tmp_path / "report.R").read_text(encoding="utf-8")
    (tmp_path / "report.R").write_text(script.replace(repr(one["statistic"]), repr(one["statistic"] + 1)))
    done = run_in_r(tmp_path)
    assert done.returncode == 1
    assert done.stdout.count("DIFFERS") == 1
    assert done.stdout.rstrip().endswith("numbers that differ: 1")


@pytest.mark.nightly
@pytest.mark.parametrize("sessions", [2, 3])
def test_r_compares_sessions(sessions: int, rek: Results, tmp_path: Path) -> None:
    for number in range(1, 9):
        draw = random.Random(number)  # noqa: S311 - reproducible
        for session in range(1, 1 + (sessions if number > 2 else 1)):
            rek.add(f"P{number:03d}", lambda *_, draw=draw: draw.randint(1, 7), session=session)
    rek.open()
    report(rek.folder, tmp_path / "report")
    done = run_in_r(tmp_path / "report")
    assert (done.returncode, done.stderr) == (0, "")
    blocks = numbers(tmp_path / "report")["results"]["blocks"]
    tested = [one for block in blocks for one in block["by_session"] if one["outcome"]["statistic"] is not None]
    assert len(tested) == 14
    assert {one["outcome"]["n"] for one in tested} == {6}
    assert done.stdout.count(", sessions " + ("Wilcoxon V" if sessions == 2 else "Friedman chi2")) == len(tested)
