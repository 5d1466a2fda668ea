"""The report: whole, self-contained, the same each time."""

import csv
import hashlib
import random
import re
import shutil
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from study_app.analysis.data.study_tables import load_study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.report import write_report
from study_app.analysis.report.sections import conduct
from study_app.analysis.report.write_report import report
from study_app.errors import AnalysisError
from study_app.store.exclusions import exclude, include, keep
from tests.analysis.conftest import HIDDEN, Results, twelve
from tests.analysis.report.read_report import answered_by_two, numbers, read, run_in_r
from tests.golden_values import page_lines

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]


def test_the_caption_of_delays_explains_the_dashed_line(of_twelve: Path) -> None:
    assert "Dashed line: shortest delay with a trend (step-down test" in read(of_twelve)


def test_every_answer_is_beside_its_figure_and_the_page_is_small(of_twelve: Path) -> None:
    page = (of_twelve / "report.html").read_text("utf-8")
    assert len(page) < 5e6
    first, _, rest = page.partition('<details class="part"')
    cards = first.split('<article class="card')[1:]
    assert [re.search(r"<h2>(.*?) <span", card)[1].partition(": ")[2] for card in cards] == [  # type: ignore[index]
        "Which liquids were distinguished?",
        "At what delay do participants begin to notice a difference?",
        "Up to what delay do answers remain practically unchanged?",
    ]
    for card in cards:
        drawing = card[card.index("<svg") :]
        assert {f'id="person-P{number:03d}"' in drawing for number in range(1, 13)} == {True}
        assert "#ffffff" not in re.sub(r"<text.*?</text>", "", drawing), "colours are those of the page, light or dark"
        assert drawing.index("</svg>") > 0
    assert rest.count("<svg") >= 3, "the other figures are in their sections"
    assert not set(re.findall(r'aria-label="([^"]*)"', first)) & set(re.findall(r'aria-label="([^"]*)"', rest))


def test_letters_of_figures_are_readable_on_a_narrow_screen_and_figures_fit_on_a_printed_page(of_twelve: Path) -> None:
    page = (of_twelve / "report.html").read_text("utf-8")
    drawings = re.findall(r'<svg role="img"[^>]*--least: (\d+)px[^>]*viewBox="0 0 ([\d.]+) .*?</svg>', page, re.DOTALL)
    figures = re.findall(r'<svg role="img".*?</svg>', page, re.DOTALL)
    assert len(drawings) == len(figures) >= 6
    for (least, width), figure in zip(drawings, figures, strict=True):
        assert min(map(float, re.findall(r"font-size: ([\d.]+)px", figure))) * int(least) / float(width) >= 11
    style = page[: page.index("</style>")]
    assert "figure svg { min-width: var(--least); }" in style
    assert "@page { size: A4;" in style
    assert re.search(r"figure svg, figure img { max-height: 2[0-6]\dmm;", style), "A4 is 297 mm high"


def test_the_report_before_unblinding_does_not_reveal_conditions(small: Results, tmp_path: Path) -> None:
    for number_ in range(1, 8):
        small.add(f"P{number_:03d}", lambda condition, _item: 6 if condition == "heavyzembla" else 2)
    report(small.folder, tmp_path / "report")
    report_text = read(tmp_path / "report")
    assert "Blinded: conditions appear as codes" in report_text
    assert "after unblinding" in report_text
    assert re.search(r" all +sealed +sealed +sealed +sealed +28 +28 of 28 ", " ".join(report_text.split()))
    assert (
        "Until unblinding, the delay error and the proportion of force held back are sealed and cannot be checked."
        in report_text
    )
    (delivered,) = numbers(tmp_path / "report")["results"]["delivered"]
    assert (delivered["error_mean_ms"], delivered["error_worst_ms"], delivered["achieved_ms"]) == (None, None, None)
    for path in (tmp_path / "report").iterdir():
        content = path.read_bytes().decode("utf-8", "replace").lower()
        assert not [word for word in HIDDEN if word in content], path.name


def test_motion_has_the_median_and_both_quartiles_of_participants(small: Results, tmp_path: Path) -> None:
    for number_, duration_s in enumerate((1.0, 2.0, 4.0, 8.0, 16.0), start=1):
        small.add(f"P{number_:03d}", lambda *_: 4, changes={"duration_s": duration_s, "force_mean_n": 20 - duration_s})
    small.open()
    report(small.folder, tmp_path / "report")
    rows = list(csv.DictReader((tmp_path / "report" / "motion.csv").read_text("utf-8").splitlines()))
    motion_rows = {
        row["measure"]: (row["n"], row["q1"], row["median"], row["q3"]) for row in rows if row["code"] == "L1"
    }
    assert motion_rows["duration_s"] == ("5", "2.0", "4.0", "8.0")
    assert motion_rows["force_mean_n"] == ("5", "12.0", "16.0", "18.0")
    assert " 5 4.00 (2.00–8.00) " in read(tmp_path / "report")
    motion_measures = numbers(tmp_path / "report")["results"]["performance"]["moved"]
    times = next(measure for measure in motion_measures if measure["measure"] == "duration_s")
    assert (times["q1"], times["median"], times["q3"]) == (2.0, 4.0, 8.0)


@pytest.mark.nightly
@pytest.mark.usefixtures("png_figures_only")
def test_exclusions_and_unfinished_sessions_are_listed(rek: Results, tmp_path: Path) -> None:
    twelve(rek, people=6)
    rek.add("P100", lambda _condition, _item: 4, status="withdrawn", trials=3)
    rek.exclude("P001", reason="fell <asleep> & left")
    rek.exclude("P002", trial=2, reason="the phone rang")
    rek.open()
    report(rek.folder, tmp_path / "report")
    report_text = read(tmp_path / "report")
    assert "participant P001, session 1: fell <asleep> & left" in report_text
    assert "participant P002, session 1, trial 2: the phone rang" in report_text
    assert "1 session was not completed and therefore not analysed" in report_text
    reasons = "(a researcher's decision: 1, unfinished session: 1; see “How the study was run”)"
    assert f"Five participants (5 x). 2 of 7 were not included {reasons}. Sessions on" in report_text
    assert numbers(tmp_path / "report")["study"]["participants"] == 5


@pytest.mark.usefixtures("png_figures_only")
def test_the_page_begins_with_the_number_of_participants_who_were_not_included_by_reason(
    small: Results, tmp_path: Path
) -> None:
    answered_by_two(small)
    decisions = (("catch", ""), ("AK", "fast_answers"), ("catch", ""), ("BL", ""), ("missing", ""))
    for number, (by, rule) in enumerate(decisions, start=3):
        small.add(f"P00{number}", lambda _condition, _item: 4)
        exclude(small.folder, f"P00{number}", 1, by=by, rule=rule, reason="a reason")
    small.open()
    report(small.folder, tmp_path / "report")
    reasons = (
        "errors in catch trials: 2, fast answers: 1, a researcher's decision: 1, trials that could not be delivered: 1"
    )
    assert f"Two participants (2 x). 5 of 7 were not included ({reasons}; see “How" in read(tmp_path / "report")


@pytest.mark.usefixtures("png_figures_only")
def test_the_page_begins_with_the_sessions_that_were_not_included_of_included_participants(
    small: Results, tmp_path: Path
) -> None:
    answered_by_two(small)
    small.add("P002", lambda _condition, _item: 3, session=2)
    exclude(small.folder, "P002", 1, by="AK", reason="the phone rang")
    small.open()
    report(small.folder, tmp_path / "report")
    assert "Two participants (2 x). All were included, but 1 of 3 sessions was not. " in read(tmp_path / "report")


def test_a_reversed_exclusion_is_listed_with_both_persons_and_reasons(small: Results) -> None:
    answered_by_two(small)
    at = datetime(2026, 3, 2, 9, tzinfo=UTC)
    for participant, by in (("P001", "DL"), ("P002", "EM")):
        exclude(small.folder, participant, 1, by=by, reason=f"{participant} spoke", now=at)
    include(small.folder, "P001", 1, by="AK", reason="only once", now=at + timedelta(days=3))
    keep(small.folder, "P001", 1, rule="fast_answers", by="AK", reason="practised")
    study = load_study(small.folder)
    page = "".join(conduct(study, evaluate(study, recordings=False)))
    exclusions, _, reversed_ones = page.partition("Exclusions that were reversed")
    assert "participant P002, session 1: P002 spoke (EM, 2026-03-02" in exclusions
    assert (
        "participant P001, session 1: P001 spoke (DL, 2026-03-02). AK included it again on 2026-03-05 (only once)."
        in reversed_ones
    )
    assert "practised" not in page, "it was never excluded"


def test_an_exception_in_the_progress_callback_ends_the_report_without_output(small: Results, tmp_path: Path) -> None:
    answered_by_two(small)
    small.open()
    progress_calls: list[tuple[str, float]] = []
    report(small.folder, tmp_path / "whole", progress=lambda what, share: progress_calls.append((what, share)))
    shares = [share for _, share in progress_calls]
    assert [what for what, _ in progress_calls if what.startswith("drawing")] == ["drawing"]
    assert shares == sorted(shares)
    assert shares[-1] <= 1
    for step in (0, len(progress_calls) // 2):
        cancel_calls: list[str] = []

        def cancel(what: str, _share: float, asked: list[str] = cancel_calls, step: int = step) -> None:
            asked.append(what)
            if len(asked) > step:
                raise AnalysisError("cancelled")

        with pytest.raises(AnalysisError, match="cancelled"):
            report(small.folder, tmp_path / "not", progress=cancel)
        assert len(cancel_calls) == step + 1
        assert not (tmp_path / "not").exists()


def test_the_settings_versions_and_hashes_of_a_report_are_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    reveals = [
        {"at": "2026-03-04", "by": "AK", "reason": "closed", "site": "Delft"},
        {"at": "5", "by": "B", "reason": "c"},
    ]
    hashes = {"data/b.csv": "2e", "data/a.csv": "1f"}
    for name, value in (("files", hashes), ("plug_ins", {"oil": ["thin", "wax"]}), ("reveals_of", reveals)):
        monkeypatch.setattr(write_report, name, lambda _study, value=value: value)
    monkeypatch.setattr(write_report, "versions", lambda: {"numpy": "2.1"})
    decided = SimpleNamespace(binding=True, alpha_text=lambda: "0.04", equivalence_bound=0.5, primary=("warm", "thick"))
    study_stand_in: Any = SimpleNamespace(folder=Path("nowhere"))
    results: Any = SimpleNamespace(decided=decided, seed=731, blocks=("a",))
    lines = list(page_lines("".join(write_report._reproduction_sentences(study_stand_in, results))))
    assert lines[:12] == [
        "Reproducing this report", "Setting | Value", "Analysis decided before the first session | yes", "Alpha | 0.04",
        "Equivalence bound for statements | ±0.5 points", "Primary statements | warm, thick",
        "Seed of the analysis | 731", "Version of numpy | 2.1", "Plug-in oil | thin, wax",
        "Key opened | site Delft, 2026-03-04 by AK: closed; 5 by B: c", "File | SHA-256", "data/b.csv | 2e",
    ]  # fmt: skip
    together = hashlib.sha256(b"1f  data/a.csv\n2e  data/b.csv\n").hexdigest()
    assert f"based on two files. The combined SHA-256 of the files' hashes and names is {together}." in lines[13]
    decided.binding, decided.equivalence_bound = False, None
    lines = list(page_lines("".join(write_report._reproduction_sentences(study_stand_in, results))))
    assert [lines[2], *lines[4:6]] == [
        "Analysis decided before the first session | no; all results are exploratory",
        "Equivalence bound for statements | none", "Primary statements | none",
    ]  # fmt: skip
    results.blocks = ()
    lines = list(page_lines("".join(write_report._reproduction_sentences(study_stand_in, results))))
    assert lines[3:5] == ["Alpha | 0.04", "Seed of the analysis | 731"]


def test_an_unwritable_folder_leaves_no_report(small: Results, tmp_path: Path) -> None:
    answered_by_two(small)
    (tmp_path / "file").write_text("x", encoding="utf-8", newline="\n")
    with pytest.raises(AnalysisError, match="cannot be written"):
        report(small.folder, tmp_path / "file" / "report")
    assert load_study(small.folder).n == 2


def test_r_computes_the_same_numbers(of_twelve: Path) -> None:
    process = run_in_r(of_twelve)
    assert (process.returncode, process.stderr) == (0, "")
    lines = process.stdout.splitlines()
    assert lines[-1] == "all numbers that R computed agree with the report"
    pattern = re.compile(r"(.+?) +report +(\S+) +R +(\S+)")
    computed = {match[1]: float(match[3]) for line in lines if (match := pattern.match(line))}
    liquids, delays = numbers(of_twelve)["results"]["blocks"]
    for test in liquids["omnibus"]:
        what = f"liquids {test['item']}, conditions differ: Friedman chi2"
        assert computed[what] == pytest.approx(test["outcome"]["statistic"], rel=1e-5)
    for trend in delays["trends"]:
        what = f"delays {trend['item']}, answers follow the delay:"
        assert computed[f"{what} Page's L"] == pytest.approx(trend["outcome"]["statistic"], rel=1e-5)
        assert computed[f"{what} exact p"] == pytest.approx(trend["outcome"]["p"], rel=1e-5)
    for contrast in delays["against"]:
        what = f"delays {contrast['item']} ({contrast['delay_ms']:g} ms − 0 ms)"
        assert computed[f"{what}, a delay is equivalent: equivalence p"] == pytest.approx(
            contrast["found"]["p"], rel=1e-5
        )
    pairs = [name for name in computed if name.endswith("two conditions differ: p")]
    assert len(pairs) == len(liquids["pairs"]) > 0


def test_r_finds_a_number_that_was_changed(of_twelve: Path, tmp_path: Path) -> None:
    for name in ("report.R", "tests.csv", "study-rek2024_description-responses_data.csv"):
        shutil.copy(of_twelve / name, tmp_path)
    trend = numbers(of_twelve)["results"]["blocks"][1]["trends"][0]["outcome"]
    tests = (tmp_path / "tests.csv").read_text(encoding="utf-8")
    changed = tests.replace(f",L,{trend['statistic']!r},", f",L,{trend['statistic'] + 1!r},", 1)
    assert changed != tests
    (tmp_path / "tests.csv").write_text(changed, encoding="utf-8", newline="\n")
    process = run_in_r(tmp_path)
    assert process.returncode == 1
    assert process.stdout.count("DIFFERS") == 1
    assert process.stdout.rstrip().endswith("numbers that differ: 1")


def test_r_explains_why_it_compares_no_number(small: Results, tmp_path: Path) -> None:
    small.add("P001", lambda _condition, _item: 4)
    report(small.folder, tmp_path / "report")
    process = run_in_r(tmp_path / "report")
    assert process.returncode == 1
    assert "nothing to compare: the key was sealed" in process.stdout


@pytest.mark.nightly
@pytest.mark.parametrize("sessions", [2, 3])
def test_r_compares_sessions(sessions: int, rek: Results, tmp_path: Path) -> None:
    for person in range(1, 9):
        draw = random.Random(person)  # noqa: S311 - reproducible
        for session in range(1, 1 + (sessions if person > 2 else 1)):
            rek.add(f"P{person:03d}", lambda *_, draw=draw: draw.randint(1, 7), session=session)
    rek.open()
    report(rek.folder, tmp_path / "report")
    process = run_in_r(tmp_path / "report")
    assert (process.returncode, process.stderr) == (0, "")
    blocks = numbers(tmp_path / "report")["results"]["blocks"]
    tested = [test for block in blocks for test in block["by_session"] if test["outcome"]["statistic"] is not None]
    assert len(tested) == 14
    assert {test["outcome"]["n"] for test in tested} == {6}
    assert process.stdout.count("sessions differ: " + ("Wilcoxon V" if sessions == 2 else "Friedman chi2")) == len(
        tested
    )
