"""The report: whole, self-contained, the same each time, honest about few participants, and fit for odd input."""

from __future__ import annotations

import base64
import csv
import io
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from fontTools.ttLib import TTFont

from study_app.analysis.findings.words import counted, listed, number, p_equals, p_value
from study_app.analysis.report.write_report import report
from study_app.analysis.tables.study import load_study
from study_app.cli import commands
from study_app.errors import AnalysisError, StudyError
from study_app.protocol.load import load, parse, source_bytes
from tests.analysis.conftest import CANNOT_JUDGE, HIDDEN, Answer, Results, make_results, twelve

FORBIDDEN = re.compile(
    r"(?i:no (significant |measurable |visible )?(effect|difference was|influence|impact)|\bhad no\b)"
    r"|\bnan\b|\bNaN\b|\binf\b|\bNone\b|[{}]"
)
"""What no report may say: that there is nothing, a number that is none, or a template that was not filled."""


class Text(HTMLParser):
    """Collects what a reader sees, and checks that every element ends where it should."""

    VOID = frozenset({"meta", "img", "br"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.told: list[str] = []
        self.tags: set[str] = set()
        self.fetched: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.fetched += [value or "" for name, value in attrs if name in ("src", "href")]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "style" not in self.open:
            self.told.append(data)


def read(folder: Path) -> str:
    """Return what the page tells, having checked that it is one file without scripts."""
    page = Text()
    page.feed((folder / "report.html").read_text(encoding="utf-8"))
    assert page.open == []
    assert not page.tags & {"script", "link", "iframe", "object", "form"}
    assert all(place.startswith(("data:image/png;base64,", "#part-")) for place in page.fetched)
    told = re.sub(r"\s+", " ", " ".join(page.told))
    assert (found := FORBIDDEN.search(told)) is None, told[max(0, found.start() - 80) : found.end() + 40]
    return told


def numbers(folder: Path) -> dict[str, Any]:
    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    told: dict[str, Any] = json.loads((folder / "report.json").read_bytes(), parse_constant=refuse)
    return told


def rows(folder: Path, name: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO((folder / name).read_text(encoding="utf-8"))))


@pytest.fixture(scope="module")
def of_twelve(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report of twelve, opened."""
    folder = tmp_path_factory.mktemp("twelve")
    results = twelve(make_results(folder / "rek2024", load("rek2024")))
    results.open()
    assert report(results.folder, folder / "report")[0].name == "report.html"
    return folder / "report"


def test_a_study_of_twelve_tells_what_was_found(of_twelve: Path) -> None:
    names = {path.name for path in of_twelve.iterdir()}
    assert {"report.json", "report.R", "methods.txt", "tests.csv", "motion.csv", "codebook.json"} <= names
    for figure in ("liquids", "recognition", "delays"):
        assert {f"{figure}.{form}" for form in ("png", "svg", "pdf", "txt")} <= names
    told = read(of_twelve)
    assert "SIMULATED" in told
    for heading in (
        *("In short", "What this study cannot show", "Do the liquids differ, statement by statement?"),
        *("Which of them differ?", "Were the liquids recognised?", "Do answers follow the delay?"),
        *("The lowest delay that shows", "Each delay against 0 ms", "Motion and force", "How it was run", "Exclusions"),
        *("Was shown what was asked for?", "Orders as run", "Methods, to paste", "Reproducing this report"),
    ):
        assert heading in told
    assert re.search(r"What was drawn was [\d.]+ ms old .*, and [\d.]+ ms at the shortest delay, with which", told)
    assert "upper bound" in told
    found = numbers(of_twelve)
    assert found["study"]["participants"] == 12
    assert found["results"]["seed"] == 1
    assert found["methods"] in told
    assert (of_twelve / "methods.txt").read_text(encoding="utf-8").strip() == found["methods"]
    assert set(found["versions"]) >= {"liquid-study", "numpy", "scipy"}
    assert "blinding/key.sealed" in found["files"]
    assert sum(name.endswith("receipt.json") for name in found["files"]) == 12


def test_the_contents_lead_to_every_section(of_twelve: Path) -> None:
    page = (of_twelve / "report.html").read_text(encoding="utf-8")
    links = re.findall(r'<a href="#([^"]+)">([^<]+)</a>', page)
    sections = re.findall(r'<details class="part" id="([^"]+)">\s*<summary><h2>([^<]+)</h2>', page)
    assert len(links) == page.count('<details class="part"') == 9
    for (target, title), (place, heading) in zip(links, sections, strict=True):
        assert target == place
        assert heading.startswith(title.split()[0])


def test_the_page_says_when_the_sessions_took_place(of_twelve: Path) -> None:
    assert "Twelve participants. Sessions on 2026-01-05." in read(of_twelve)


def test_the_typeface_is_in_the_page_with_every_sign(of_twelve: Path) -> None:
    page = (of_twelve / "report.html").read_text(encoding="utf-8")
    fonts = re.findall(r"font-weight: (\d+); src: url\(data:font/woff;base64,([^)]+)\)", page)
    assert [weight for weight, _ in fonts] == ["400", "600"]
    assert "font-src data:" in page
    signs = {sign for sign in read(of_twelve) if sign.isprintable()}
    for _, data in fonts:
        assert signs <= {chr(code) for code in TTFont(io.BytesIO(base64.b64decode(data))).getBestCmap()}


def test_every_test_is_a_row_with_what_a_reader_needs(of_twelve: Path) -> None:
    tests = rows(of_twelve, "tests.csv")
    assert {row["question"] for row in tests} >= {"settings differ", "liquids are recognised", "a delay is noticed"}
    for row in tests:
        assert row["n"] != "n/a"
        assert "n/a" not in (row["p"], row["effect"]) or {row["note"], row["interval"]} != {"n/a"}
        assert row["interval"] != "n/a"
        assert (row["family"] == "n/a") == (row["question"] == "a delay is noticed")
    found = numbers(of_twelve)
    omnibus = found["results"]["blocks"][0]["omnibus"]
    listed_ps = [row["p_adjusted"] for row in tests if row["family"] == "liquids: settings differ"]
    assert [float(p) for p in listed_ps] == pytest.approx([one["p_adjusted"] for one in omnibus])


def test_of_five_it_says_what_cannot_be_shown_and_what_a_delay_can_mean(rek: Results, tmp_path: Path) -> None:
    twelve(rek, people=5).open()
    report(rek.folder, tmp_path / "report")
    told = read(tmp_path / "report")
    assert "5 participants cannot show it: the smallest p that 5 pairs can give is 0.0625" in told
    assert "no bootstrap interval and no mixed model" in told
    assert re.search(r"What “\d+ ms” can and cannot mean", told)
    assert "is no evidence that" in told
    assert "80 % power would take about" in told
    assert "inconclusive" in told
    assert "nothing was asked about delays between them" in told


def test_the_same_results_give_the_same_bytes(rek: Results, tmp_path: Path) -> None:
    twelve(rek, people=3).open()
    for name in ("one", "two"):
        report(rek.folder, tmp_path / name)
    for path in (tmp_path / "one").iterdir():
        assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes(), path.name


def test_while_sealed_nothing_is_told_that_blinding_hides(small: Results, tmp_path: Path) -> None:
    for number_ in range(1, 8):
        small.add(f"P{number_:03d}", lambda condition, _item: 6 if condition == "heavyzembla" else 2)
    report(small.folder, tmp_path / "report")
    told = read(tmp_path / "report")
    assert "Blinded: by code" in told
    assert "after unblinding" in told
    assert re.search(r" all +sealed +sealed +sealed +sealed +28 +28 of 28 ", " ".join(told.split()))
    assert "Until unblinding delay error and force withheld are sealed, and not judged." in told
    (delivered,) = numbers(tmp_path / "report")["results"]["delivered"]
    assert (delivered["error_mean_ms"], delivered["error_worst_ms"], delivered["achieved_ms"]) == (None, None, None)
    for path in (tmp_path / "report").iterdir():
        content = path.read_bytes().decode("utf-8", "replace").lower()
        assert not [word for word in HIDDEN if word in content], path.name


def test_the_exclusions_and_what_was_not_completed_are_listed(rek: Results, tmp_path: Path) -> None:
    twelve(rek, people=6)
    rek.add("P100", lambda _condition, _item: 4, status="withdrawn", trials=3)
    rek.exclude("P001", reason="fell <asleep> & left")
    rek.exclude("P002", trial=2, reason="the phone rang")
    rek.open()
    report(rek.folder, tmp_path / "report")
    told = read(tmp_path / "report")
    assert "participant P001, session 1: fell <asleep> & left" in told
    assert "participant P002, session 1, trial 2: the phone rang" in told
    assert "1 session not completed" in told
    assert numbers(tmp_path / "report")["study"]["participants"] == 5


def test_one_participant_all_equal_and_missing_answers_give_a_report_that_says_so(rek: Results, tmp_path: Path) -> None:
    rek.add("P001", lambda _condition, _item: 4)
    rek.open()
    report(rek.folder, tmp_path / "one")
    alone = read(tmp_path / "one")
    assert "about this person alone" in alone
    assert not re.search(r"\b1 participants", alone)
    assert run_in_r(tmp_path / "one").returncode == 0
    assert "1 pairs" not in alone

    def gaps(condition: str, item: str) -> Answer:
        return None if (condition, item) in (("honey", "immersive"), ("delay_50", "harder")) else 4

    for number_ in range(2, 7):
        rek.add(f"P{number_:03d}", gaps)
    report(rek.folder, tmp_path / "equal")
    told = read(tmp_path / "equal")
    assert "not tested (no variation: every participant answered alike under all settings)" in told
    assert "no statement could be tested (no variation: every participant answered alike under all settings)" in told
    assert "“Feels like a liquid”, “Immersive”, “Adequate force”" in told
    assert "could not be tested: no variation" in told
    assert "equivalence needs at least 14 participants (11 where all differences are equal)" in told
    assert "Skillings-Mack" in told
    assert "Effects of the mixed model" not in told
    numbers(tmp_path / "equal")


def test_methods_distinguish_primary_and_exploratory_statements(tmp_path: Path) -> None:
    text = (
        source_bytes("rek2024").decode().replace("\n[analysis]\n", '\n[analysis]\nprimary = ["immersive", "harder"]\n')
    )
    results = twelve(make_results(tmp_path / "some", parse(text.encode(), "rek2024.toml")), people=5)
    results.open()
    report(results.folder, tmp_path / "report")
    told = (tmp_path / "report" / "methods.txt").read_text(encoding="utf-8")
    both = "p adjusted over 1 statement by Holm (primary) and over {} statements by Benjamini-Hochberg (exploratory)"
    assert both.format("eight") in told
    assert both.format("four") in told


@pytest.mark.parametrize(
    ("valid", "within", "told"),
    [
        (None, "not measured", "Whether trials kept to the protocol's limits of timing was not measured."),
        (True, "1 of 1", "No trial that counts exceeded the protocol's limits of timing."),
        (False, "0 of 1", "Ten trials exceeded the protocol's limits of timing and are in these numbers."),
    ],
)
def test_what_was_not_measured_is_neither_within_limits_nor_beyond(
    rek: Results, tmp_path: Path, valid: bool | None, within: str, told: str
) -> None:
    rek.add("P001", lambda *_: 4, changes={"valid": valid})
    rek.open()
    report(rek.folder, tmp_path / "report")
    page = read(tmp_path / "report")
    assert told in page
    assert f" {within} " in page


def test_answers_off_the_scale_are_missing_and_never_neutral(small: Results, tmp_path: Path) -> None:
    for number_ in range(1, 9):
        small.add(
            f"P{number_:03d}",
            lambda condition, item: CANNOT_JUDGE if item == "warm" else 6 if condition == "heavyzembla" else 3,
        )
    small.open()
    report(small.folder, tmp_path / "report")
    assert "no participant answered under both settings" in read(tmp_path / "report")


def test_sessions_without_a_completed_one_give_a_report_without_findings(rek: Results, tmp_path: Path) -> None:
    rek.add("P001", lambda _condition, _item: 4, status="withdrawn", trials=2)
    report(rek.folder, tmp_path / "report")
    told = read(tmp_path / "report")
    assert "there are no findings" in told
    assert "nobody's answers count yet" in told
    assert not (tmp_path / "report" / "liquids.png").exists()


def test_a_hand_edited_answer_of_nine_is_one_clear_error(rek: Results, tmp_path: Path) -> None:
    twelve(rek, people=2)
    path = rek.responses("P001")
    lines = path.read_text(encoding="utf-8").splitlines()
    place = lines[0].split(",").index("response")
    cells = lines[3].split(",")
    cells[place] = "9"
    path.write_text("\n".join([*lines[:3], ",".join(cells), *lines[4:]]) + "\n", encoding="utf-8")
    with pytest.raises(AnalysisError, match="row 3, column response: '9' is not a whole number from 1 to 7"):
        report(rek.folder, tmp_path / "report")
    assert not (tmp_path / "report").exists()


def test_another_study_mixed_in_or_an_empty_folder_is_one_clear_error(
    rek: Results, small: Results, tmp_path: Path
) -> None:
    twelve(rek, people=2)
    foreign = small.add("P077", lambda _condition, _item: 4)
    shutil.copytree(foreign.path.parent, rek.folder / "data" / "sub-P077")
    for _ in ("sealed", "opened"):
        with pytest.raises(AnalysisError, match=r"is of the study 'small', .* keep each study in a folder of its own"):
            report(rek.folder, tmp_path / "report")
        shutil.move(rek.folder / "data" / "sub-P077", tmp_path / "sub-P077")
        rek.open()
        shutil.move(tmp_path / "sub-P077", rek.folder / "data" / "sub-P077")
    (tmp_path / "empty").mkdir()
    with pytest.raises(AnalysisError, match="holds no sessions"):
        report(tmp_path / "empty", tmp_path / "report")
    assert not (tmp_path / "report").exists()


def _answered(small: Results) -> None:
    for number_ in (1, 2):
        small.add(f"P{number_:03d}", lambda condition, _item: 6 if condition == "heavyzembla" else 3)


def test_it_can_be_cancelled_at_every_step_and_then_nothing_is_written(small: Results, tmp_path: Path) -> None:
    _answered(small)
    small.open()
    told: list[tuple[str, float]] = []
    report(small.folder, tmp_path / "whole", progress=lambda what, share: told.append((what, share)))
    shares = [share for _, share in told]
    assert shares == sorted(shares)
    assert shares[-1] <= 1
    for step in (0, len(told) // 2):
        asked: list[bool] = []

        def cancelled(asked: list[bool] = asked, step: int = step) -> bool:
            asked.append(True)
            return len(asked) > step

        with pytest.raises(StudyError, match="cancelled; nothing was written"):
            report(small.folder, tmp_path / "not", cancelled=cancelled)
        assert len(asked) == step + 1
        assert not (tmp_path / "not").exists()


def test_the_script_in_r_has_every_number_of_the_report(of_twelve: Path) -> None:
    script = (of_twelve / "report.R").read_text(encoding="utf-8")
    assert 'read.csv("study-rek2024_description-responses_data.csv"' in script
    for left, right in ("()", "{}"):
        assert script.count(left) == script.count(right)
    found = numbers(of_twelve)["results"]["blocks"]
    for one in (*found[0]["omnibus"], *found[1]["trends"]):
        assert repr(one["outcome"]["statistic"]) in script
    for one in found[1]["against"]:
        assert repr(one["found"]["p"]) in script


def run_in_r(folder: Path) -> subprocess.CompletedProcess[str]:
    if shutil.which("Rscript") is None:
        pytest.skip("no Rscript here: the script of the report is not run")
    return subprocess.run(["Rscript", "report.R"], cwd=folder, capture_output=True, text=True, check=False)


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


def test_missing_answers_are_counted_where_they_are_and_what_is_one_way_is_said_so(
    rek: Results, tmp_path: Path
) -> None:
    def gaps(condition: str, item: str) -> Answer:
        if (condition, item) in (("honey", "immersive"), ("honey", "like_tar"), ("delay_50", "harder")):
            return None
        return {"water": 1, "honey": 6}.get(condition, 1 + (len(condition) * len(item)) % 7)

    for number_ in range(1, 9):
        rek.add(f"P{number_:03d}", gaps)
    rek.open()
    report(rek.folder, tmp_path / "report")
    told = read(tmp_path / "report")
    assert "n = 8 participants, every liquid presented to all, 16 of 216 ratings missing" in told
    assert "n = 8 participants, every delay presented to all, 8 of 280 ratings missing" in told
    assert "−1.00 – (all 8 one way)" in told
    pairs = [row for row in rows(tmp_path / "report", "tests.csv") if row["question"] == "two settings differ"]
    assert {row["note"] for row in pairs if row["effect"] != "n/a"} == {"all 8 pairs that differ went one way"}
    done = run_in_r(tmp_path / "report")
    assert (done.returncode, done.stderr) == (0, "")


def test_what_a_block_cannot_have_is_said_and_validity_stands_beside_what_was_measured(of_twelve: Path) -> None:
    told = read(of_twelve)
    sections = re.search(r".*Motion and force (.*?) Delay effect (.*?) Reaches:", told)
    assert sections is not None
    assert "No reaching task in this block" in sections[1]
    assert "No reaching task in this block" not in sections[2]
    assert "none of its recordings could be read" in sections[2]
    for section in sections.groups():
        assert "trials within limits" in section
        assert "12 of 12" in section
    for row in rows(of_twelve, "motion.csv"):
        assert (row["trials"], row["judged"], row["valid"]) == ("12", "12", "12")


def test_the_command_writes_it_and_tells_errors_in_one_line(small: Results, tmp_path: Path) -> None:
    _answered(small)
    done = CliRunner().invoke(commands, ["report", str(small.folder), "--to", str(tmp_path / "report")])
    assert done.exit_code == 0, done.output
    assert "report.html" in done.output
    assert (tmp_path / "report" / "report.html").is_file()
    failed = CliRunner().invoke(commands, ["report", str(tmp_path / "nowhere"), "--to", str(tmp_path / "x")])
    assert isinstance(failed.exception, AnalysisError)


@pytest.mark.parametrize(
    ("told", "expected"),
    [
        (p_value(0.0499), ".050"),
        (p_value(0.00004), "< .0001"),
        (p_value(0.00044), ".0004"),
        (p_value(0.9999), "1"),
        (p_value(None), "–"),
        (p_equals(0.00001), "p < .0001"),
        (p_equals(0.031), "p = .031"),
        (number(-0.0001), "0.00"),
        (number(-1.25, 1), "−1.2"),
        (number(None), "–"),
        (counted(1, "delay"), "1 delay"),
        (counted(3, "delay"), "three delays"),
        (listed(["a", "b", "c"]), "a, b and c"),
        (listed(["a"]), "a"),
    ],
)
def test_numbers_in_words(told: str, expected: str) -> None:
    assert told == expected


def test_an_unreadable_place_leaves_nothing(small: Results, tmp_path: Path) -> None:
    _answered(small)
    (tmp_path / "file").write_text("x")
    with pytest.raises(AnalysisError, match="cannot be written"):
        report(small.folder, tmp_path / "file" / "report")
    assert load_study(small.folder).n == 2
