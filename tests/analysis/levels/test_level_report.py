"""The report of blocks of levels: by code until the key is opened, then the answers at each level."""

import json
import math
import re
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import binomtest, ttest_1samp

from study_app.analysis.designs.level_summaries import levels_found
from study_app.analysis.figures.plotting import plot
from study_app.analysis.report.write_report import report
from study_app.analysis.results.level_results import LevelsFound
from study_app.analysis.tables.study_tables import load_study
from study_app.protocol.load import load
from study_app.store.blinded.blinding import read_key
from study_app.store.blinded.sealing import opened
from study_app.store.blinded.whole_protocol import whole_protocol
from study_app.store.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.receipt import read
from study_app.store.verification.leaks import certain_telltales, presented_numbers
from tests.compiled import needs_servo

pytestmark = [pytest.mark.nightly, pytest.mark.slow, needs_servo]
BLOCKS = ["viscosity", "detect", "rate", "number", "equal", "odd", "pairs"]
ODD = {"SC": "second", "CS": "first"}


def answers(folder: Path, block: str) -> list[tuple[str, dict[str, Any], Any]]:
    """Return participant, what was presented and the answer, straight from the journals."""
    found = []
    key = read_key(folder)
    for session in StudyFolder(folder).sessions():
        started: dict[int, dict[str, Any]] = {}
        for line in opened(journal.read(session.journal), key):
            if line["event"] == "trial_started" and line["block"] == block:
                started[line["trial"]] = line
            elif line["event"] == "responses" and line["trial"] in started:
                found.append((session.participant, started[line["trial"]], line["items"][0]["value"]))
    return found


def found_in(folder: Path, block: str) -> LevelsFound:
    return next(one for one in levels_found(load_study(folder)) if one.block == block)


def test_forced_choices_give_the_share_correct_per_level_participant_and_standard(opened_levels: Path) -> None:
    found = found_in(opened_levels, "viscosity")
    right: dict[tuple[Any, ...], list[bool]] = defaultdict(list)
    for person, trial, answer in answers(opened_levels, "viscosity"):
        right[person, trial["standard"], trial["level"]].append(answer == ODD[trial["arrangement"]])
    own = {(one.participant, one.standard, one.level): one for one in found.answers if one.participant}
    assert {which: (one.count, one.n) for which, one in own.items()} == {
        which: (sum(held), len(held)) for which, held in right.items()
    }
    assert (found.counts, found.guess_rate, found.vary, found.level_kind) == ("correct", 0.5, "viscosity_pa_s", "weber")
    for one in own.values():
        exact = binomtest(one.count or 0, one.n).proportion_ci(0.95, method="exact")
        assert (one.low, one.high) == pytest.approx((exact.low, exact.high))
    assert [(one.standard, one.level, one.comparison) for one in found.of_group] == [
        (standard, level, pytest.approx(standard * (1 + level))) for standard in (1.0, 2.0) for level in (0.2, 0.4, 0.8)
    ]


def test_the_group_is_the_mean_of_participants_with_students_interval(opened_levels: Path) -> None:
    found = found_in(opened_levels, "rate")
    assert len(found.of_group) > 1
    for one in found.of_group:
        shares = [each.value for each in found.answers if each.participant and each.level == one.level]
        assert one.participants == len(shares) == 3
        assert one.value == pytest.approx(np.mean(shares))
        if len(set(shares)) > 1:
            ends = ttest_1samp(shares, 0.0).confidence_interval(0.95)
            assert (one.low, one.high) == pytest.approx((max(ends.low, 1.0), min(ends.high, 5.0)))
        else:
            assert (one.low, one.high) == (None, None)


def test_yes_no_counts_yes_and_shows_the_standard_alone_as_level_0(opened_levels: Path) -> None:
    found = found_in(opened_levels, "detect")
    assert found.counts == "yes"
    yes = Counter(trial["level"] for _, trial, answer in answers(opened_levels, "detect") if answer == "yes")
    assert {one.level: one.count for one in found.of_group} == {level: yes[level] for level in (0.0, 0.2, 0.4, 0.8)}


def test_where_levels_are_values_no_answer_is_correct(opened_levels: Path) -> None:
    found = found_in(opened_levels, "equal")
    assert (found.counts, found.guess_rate, found.level_kind) == ("comparison chosen", None, "value")
    chosen = Counter(
        trial["level"] for _, trial, answer in answers(opened_levels, "equal") if answer == ODD[trial["arrangement"]]
    )
    assert {one.level: one.count for one in found.of_group} == {level: chosen[level] for level in (0.5, 2.0, 8.0)}


def test_the_odd_interval_is_correct_at_values_on_both_sides_of_the_standard_and_has_no_threshold(
    opened_levels: Path,
) -> None:
    found = found_in(opened_levels, "odd")
    assert (found.counts, found.guess_rate, found.level_kind) == ("correct", 1 / 3, "value")
    right: Counter[float] = Counter()
    for _, trial, answer in answers(opened_levels, "odd"):
        odd = "C" if trial["arrangement"].count("C") == 1 else "S"
        right[trial["level"]] += answer == ["first", "second", "third"][trial["arrangement"].index(odd)]
    assert {one.level: one.count for one in found.of_group} == {level: right[level] for level in (0.5, 2.0, 8.0)}
    assert {one.n for one in found.of_group} == {6}
    assert (found.family, found.thresholds) == (None, ())
    assert found_in(opened_levels, "equal").family == "normal"


def test_numbers_give_geometric_means_without_the_modulus(opened_levels: Path) -> None:
    found = found_in(opened_levels, "number")
    given: dict[Any, list[float]] = defaultdict(list)
    for person, trial, answer in answers(opened_levels, "number"):
        if trial["index"] > 1:
            given[person, trial["level"]].append(float(answer))
    own = {(one.participant, one.level): one for one in found.answers if one.participant}
    assert {which: one.n for which, one in own.items()} == dict.fromkeys(given, 2)
    for which, numbers in given.items():
        assert own[which].value == pytest.approx(math.prod(numbers) ** (1 / len(numbers)))
    for one in found.of_group:
        means = [each.value for (_, level), each in own.items() if level == one.level]
        assert one.value == pytest.approx(math.prod(means) ** (1 / 3))


def test_compared_conditions_are_named_in_the_order_of_the_protocol(opened_levels: Path) -> None:
    found = found_in(opened_levels, "pairs")
    key = read_key(opened_levels)
    right: dict[str, list[bool]] = defaultdict(list)
    for _, trial, answer in answers(opened_levels, "pairs"):
        right[key.codes["pairs"][trial["code"]]].append(answer == ODD[trial["arrangement"]])
    assert [(one.comparison, one.count, one.n) for one in found.of_group] == [
        (name, sum(right[name]), 12) for name in ("other", "late")
    ]
    assert found.vary is None


def test_report_has_a_table_a_figure_and_numbers_of_every_block_of_levels(reported_levels: Path) -> None:
    page = (reported_levels / "report.html").read_text()
    held = json.loads((reported_levels / "report.json").read_text())["results"]["levels"]
    assert [one["block"] for one in held] == BLOCKS
    for block in held:
        assert (reported_levels / f"levels-{block['block']}.png").stat().st_size > 10_000
        caption = (reported_levels / f"levels-{block['block']}.txt").read_text()
        assert "SIMULATED participants" in caption
        people = {one["participant"] for one in block["answers"]}
        assert people == {None, "P001", "P002", "P003"}
    assert page.count("Answers at each level</h3>") == 6
    assert page.count("Time to answer</h3>") == 7
    assert "Not yet revealed" not in page
    assert "share correct" in page
    assert "share “yes”" in page
    assert "No answers count" not in page


def test_answer_times_are_those_of_the_journal(sealed_levels: Path) -> None:
    found = found_in(sealed_levels, "rate")
    (times,) = found.times
    seconds = []
    for session in StudyFolder(sealed_levels).sessions():
        asked = {}
        for line in journal.read(session.journal):
            if line["event"] == "trial_started":
                asked[line["trial"]] = line["block"]
            if line["event"] == "responses" and asked[line["trial"]] == "rate":
                (item,) = line["items"]
                seconds.append(item["first_s"] - item["onset_s"])
    assert times.numbers["n"] == len(seconds) == 18
    assert times.numbers["median"] == pytest.approx(np.median(seconds), abs=1e-5)


def test_report_of_a_sealed_folder_shows_counts_and_times_by_code_and_no_level(
    sealed_levels: Path, tmp_path: Path
) -> None:
    report(sealed_levels, tmp_path)
    page = (tmp_path / "report.html").read_text()
    held = json.loads((tmp_path / "report.json").read_text())["results"]["levels"]
    assert page.count("Not yet revealed") == len(BLOCKS)
    assert [one["answers"] for one in held] == [[]] * len(BLOCKS)
    assert all(one["vary"] is None and one["level_kind"] is None for one in held)
    assert sum(times["numbers"]["n"] for one in held for times in one["times"]) == 3 * 54
    assert not list(tmp_path.glob("levels-*"))
    key = read_key(sealed_levels)
    published = read(StudyFolder(sealed_levels).sessions()[0].receipt)["protocol"]
    levels = presented_numbers(whole_protocol(published, key))
    assert levels == presented_numbers(load(str(sealed_levels.parent / "levels.toml")))
    words = certain_telltales(key.tables, published, levels)
    for path in tmp_path.iterdir():
        if path.suffix in {".html", ".json", ".txt", ".csv", ".R"}:
            told = words.in_text(path.read_text(encoding="utf-8"))
            assert [word for word in told if word != "other"] == [], path.name  # a condition, and an English word
    assert "viscosity_pa_s" not in page


def test_plot_draws_the_questions_and_levels_of_a_study_without_statements(opened_levels: Path, tmp_path: Path) -> None:
    written = {path.name for path in plot(opened_levels, tmp_path)}
    assert {f"levels-{block}.{form}" for block in BLOCKS for form in ("png", "svg", "pdf", "txt")} < written
    assert "question-viscosity-choice_2ifc.png" in written


def test_figures_name_quantities_and_titles_not_keys(reported_levels: Path) -> None:
    drawn = {path.stem: path.read_text(encoding="utf-8") for path in reported_levels.glob("*.svg")}
    assert "Weber fraction of viscosity<" in drawn["levels-viscosity"]
    assert "standard 2 Pa·s<" in drawn["levels-viscosity"]
    assert "Viscosity [Pa·s]<" in drawn["levels-number"]
    assert "Condition<" in drawn["levels-pairs"]
    assert "Viscosity: Answer<" in drawn["question-viscosity-choice_2ifc"]
    for name, svg in drawn.items():
        shown = re.findall(r">([^<>]+)</text>", svg)
        assert len(shown) > 3, name
        assert [words for words in shown if "_" in words] == [], name
    assert "Comparison [Pa·s]</th>" in (reported_levels / "report.html").read_text()
