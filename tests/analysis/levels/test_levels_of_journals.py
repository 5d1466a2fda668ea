"""What is found, reported and exported of blocks of levels is what journals hold; while sealed, nothing tells it."""

import csv
import json
import math
import re
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.stats import binomtest, ttest_1samp

from study_app.analysis.designs.level_summaries import levels_found
from study_app.analysis.export.export import export
from study_app.analysis.figures.plotting import plot
from study_app.analysis.report.write_report import report
from study_app.analysis.results.level_results import LevelsFound
from study_app.analysis.tables.study_tables import load_study
from study_app.protocol.load import load
from study_app.protocol.trials.methods.updown import UpDown
from study_app.protocol.trials.stimuli import Stimulus
from study_app.store.blinded.blinding import read_key
from study_app.store.blinded.sealing import opened
from study_app.store.blinded.whole_protocol import whole_protocol
from study_app.store.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.receipt import read
from study_app.store.tables.column import header
from study_app.store.tables.columns import INTERVALS
from study_app.store.tables.level_columns import THRESHOLDS
from study_app.store.verification.leaks import certain_telltales, presented_numbers

pytestmark = pytest.mark.slow

BLOCKS = ["viscosity", "detect", "rate", "number", "equal", "odd", "pairs"]
STIMULUS = Stimulus(vary="damping_nspm", levels=(0.02, 0.6), standards=(4, 8))
STEPS = UpDown(tracks=2, trials=24, step_up=2)


class Answered(NamedTuple):
    """A trial of a journal: the line with which it started, and the answer."""

    participant: str
    started: dict[str, Any]
    value: Any
    response_s: float

    @property
    def right(self) -> bool:
        """Whether the answer is that to the comparison: yes, the comparison's interval, or the odd one."""
        arrangement = self.started["arrangement"]
        if len(arrangement) == 1:
            return bool((self.value == "yes") == (arrangement == "C"))
        odd = "C" if arrangement.count("C") == 1 else "S"
        return bool(["first", "second", "third"].index(self.value) == arrangement.index(odd))


def answered(folder: Path, block: str) -> list[Answered]:
    found = []
    key = read_key(folder)
    for session in StudyFolder(folder).sessions():
        started: dict[int, dict[str, Any]] = {}
        for line in opened(journal.read(session.journal), key):
            if line["event"] == "trial_started" and line["block"] == block:
                started[line["trial"]] = line
            elif line["event"] == "responses" and line["trial"] in started:
                (item,) = line["items"]
                seconds = item["first_s"] - item["onset_s"]
                found.append(Answered(session.participant, started[line["trial"]], item["value"], seconds))
    return found


def found_in(folder: Path, block: str) -> LevelsFound:
    return next(one for one in levels_found(load_study(folder)) if one.block == block)


def rows(folder: Path, name: str, study: str) -> list[dict[str, str]]:
    with (folder / f"study-{study}_description-{name}_data.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def exported(opened_levels: Path, opened_adaptive: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    to = tmp_path_factory.mktemp("export")
    for study in (opened_levels, opened_adaptive):
        export(study, to, extras={"sav", "parquet"})
    return to


@pytest.mark.parametrize(
    ("block", "counts", "guess_rate", "level_kind", "family"),
    [
        ("viscosity", "correct", 0.5, "weber", "weibull"),
        ("detect", "yes", None, "weber", "normal"),
        ("equal", "comparison chosen", None, "value", "normal"),
        ("odd", "correct", 1 / 3, "value", None),
    ],
)
def test_choices_are_counted_per_level_participant_and_standard(
    opened_levels: Path, block: str, counts: str, guess_rate: float | None, level_kind: str, family: str | None
) -> None:
    found = found_in(opened_levels, block)
    assert (found.counts, found.guess_rate, found.level_kind) == (counts, guess_rate, level_kind)
    assert (found.vary, found.family) == ("viscosity_pa_s", family)
    held: dict[tuple[Any, ...], list[bool]] = defaultdict(list)
    for one in answered(opened_levels, block):
        counted = one.value == "yes" if block == "detect" else one.right
        held[one.participant, one.started["standard"], one.started["level"]].append(counted)
    own = {(one.participant, one.standard, one.level): one for one in found.answers if one.participant}
    assert {which: (one.count, one.n) for which, one in own.items()} == {
        which: (sum(counted), len(counted)) for which, counted in held.items()
    }
    for one in own.values():
        exact = binomtest(one.count or 0, one.n).proportion_ci(0.95, method="exact")
        assert (one.low, one.high) == pytest.approx((exact.low, exact.high))
    of_level: Counter[tuple[Any, ...]] = Counter()
    for (_, *which), counted in held.items():
        of_level[tuple(which)] += sum(counted)
    assert {(one.standard, one.level): one.count for one in found.of_group} == of_level
    if level_kind == "weber":
        assert [one.comparison for one in found.of_group] == pytest.approx(
            [one.standard * (1 + one.level) for one in found.of_group]
        )


def test_compared_conditions_are_named_in_the_order_of_the_protocol(opened_levels: Path) -> None:
    found, key = found_in(opened_levels, "pairs"), read_key(opened_levels)
    right: dict[str, list[bool]] = defaultdict(list)
    for one in answered(opened_levels, "pairs"):
        right[key.codes["pairs"][one.started["code"]]].append(one.right)
    assert [(one.comparison, one.count, one.n) for one in found.of_group] == [
        (name, sum(right[name]), 12) for name in ("other", "late")
    ]
    assert found.vary is None


def test_ratings_have_means_and_numbers_geometric_means_without_the_modulus(opened_levels: Path) -> None:
    rated = found_in(opened_levels, "rate")
    for one in rated.of_group:
        shares = [each.value for each in rated.answers if each.participant and each.level == one.level]
        assert (one.participants, one.value) == (len(shares), pytest.approx(np.mean(shares)))
        if len(set(shares)) == 1:
            assert (one.low, one.high) == (None, None)
        else:
            ends = ttest_1samp(shares, 0.0).confidence_interval(0.95)
            assert (one.low, one.high) == pytest.approx((max(ends.low, 1.0), min(ends.high, 5.0)))
    numbered = found_in(opened_levels, "number")
    given: dict[Any, list[float]] = defaultdict(list)
    for each in answered(opened_levels, "number"):
        if each.started["index"] > 1:
            given[each.participant, each.started["level"]].append(float(each.value))
    own = {(one.participant, one.level): one for one in numbered.answers if one.participant}
    assert {which: one.n for which, one in own.items()} == dict.fromkeys(given, 2)
    for which, numbers in given.items():
        assert own[which].value == pytest.approx(math.prod(numbers) ** (1 / len(numbers)))
    for one in numbered.of_group:
        means = [each.value for (_, level), each in own.items() if level == one.level]
        assert one.value == pytest.approx(math.prod(means) ** (1 / 3))


def test_times_to_answer_are_those_of_the_journal(sealed_levels: Path, opened_adaptive: Path) -> None:
    (times,) = found_in(sealed_levels, "rate").times
    seconds = [one.response_s for one in answered(sealed_levels, "rate")]
    assert (times.numbers["n"], len(seconds)) == (18, 18)
    assert times.numbers["median"] == pytest.approx(np.median(seconds), abs=1e-5)
    by_level = found_in(opened_adaptive, "staircase").level_times
    trials = answered(opened_adaptive, "staircase")
    assert sum(one.right_n + one.wrong_n for one in by_level) == len(trials)
    for one in by_level:
        here = [it for it in trials if it.started["standard"] == one.standard]
        here = [it for it in here if one.low <= it.started["level"] <= one.high]
        for n, median_s, right in ((one.right_n, one.right_s, True), (one.wrong_n, one.wrong_s, False)):
            own = [it.response_s for it in here if it.right == right]
            assert (n, median_s) == (len(own), pytest.approx(np.median(own), abs=1e-5) if own else None)


def test_tracks_have_a_row_per_trial_with_what_it_presented(opened_levels: Path, exported: Path) -> None:
    tracks, key = rows(exported, "tracks", "levels"), read_key(opened_levels)
    assert len(tracks) == 3 * 54
    of_trial = {(row["participant"], row["trial"]): row for row in tracks}
    for block in BLOCKS:
        for one in answered(opened_levels, block):
            row, line = of_trial[one.participant, str(one.started["trial"])], one.started
            assert (row["block"], row["arrangement"]) == (block, line["arrangement"])
            assert row["track"] == key.codes[block][line["code"]]
            assert row["level_asked"] == ("n/a" if line["level"] is None else str(line["level"]))
            assert row["standard"] == ("n/a" if line["standard"] is None else str(line["standard"]))
            assert row["response_s"] == str(round(one.response_s, 6))
            judged = block in ("viscosity", "pairs", "detect", "odd")
            assert row["right"] == (str(one.right).lower() if judged else "n/a"), block
            modulus = block == "number" and row["index"] == "1"
            assert row["analysed"] == str(not modulus).lower()
    assert {int(row["slot"]) for row in tracks if row["block"] == "viscosity"} == set(range(1, 7))
    letters: dict[tuple[str, str], str] = defaultdict(str)
    for row in rows(exported, "intervals", "levels"):
        letters[row["participant"], row["trial"]] += {"standard": "S", "comparison": "C"}[row["presented"]]
    assert letters == {which: row["arrangement"] for which, row in of_trial.items()}
    trials = rows(exported, "trials", "levels")
    assert {(row["liquid"], row["delay_ms"]) for row in trials if row["block"] == "viscosity"} == {("n/a", "n/a")}
    assert {row["liquid"] for row in trials if row["block"] == "pairs"} == {"thin", "thick"}


def test_reversals_and_their_means_are_those_of_the_tracks_as_they_ran(opened_adaptive: Path, exported: Path) -> None:
    reversals = {
        (row["participant"], int(row["trial"])): row["reversal"] for row in rows(exported, "tracks", "adaptive")
    }
    key, ran = read_key(opened_adaptive), defaultdict(list)
    for one in answered(opened_adaptive, "staircase"):
        ran[one.participant, key.codes["staircase"][one.started["code"]]].append(one)
    means: dict[tuple[str, str], list[float]] = defaultdict(list)
    for (person, track), answers in ran.items():
        staircase = STEPS.staircase(STIMULUS, int(track[-1]))
        heard = [(math.log10(one.started["level"]), one.right) for one in answers]
        at = staircase.reversals_at(heard)
        assert [reversals[person, one.started["trial"]] for one in answers] == [
            "true" if place in at else "false" for place in range(len(answers))
        ]
        mean = staircase.mean_of_reversals(heard, STEPS.average)
        means[person, track.partition("/")[0]] += [] if mean is None else [mean]
    for row in rows(exported, "thresholds", "adaptive"):
        own = means[row["participant"], f"{float(row['standard']):g}"] if row["block"] == "staircase" else []
        assert (
            row["reversal_mean"] == "n/a"
            if not own
            else float(row["reversal_mean"]) == pytest.approx(10 ** np.mean(own))
        )
    assert any(means.values())


def test_the_table_of_thresholds_has_a_row_per_participant_and_standard(opened_adaptive: Path, exported: Path) -> None:
    table = rows(exported, "thresholds", "adaptive")
    assert list(table[0])[5:] == list(header(THRESHOLDS))
    blocks = [found_in(opened_adaptive, name) for name in ("staircase", "quest")]
    own = [(block, one) for block in blocks for one in block.own_thresholds]
    sensitive = [one for block in blocks for one in block.sensitivities if one.participant]
    assert len(own) == 3 * 3
    for row, (block, one), other in zip(table, own, sensitive, strict=True):
        assert (row["block"], row["participant"]) == (block.block, one.participant)
        assert float(row["standard"]) == one.standard
        for name in ("threshold", "low", "high", "width", "lapse", "fit_p", "drift", "target_percent"):
            value = getattr(one, name)
            assert row[name] == "n/a" if value is None else float(row[name]) == pytest.approx(value, rel=1e-9), name
        assert float(row["flat_width_threshold"]) == pytest.approx(one.flat_width)
        assert float(row["d_prime"]) == pytest.approx(other.d_prime)
        assert row["criterion"] == ("n/a" if block.block == "quest" else str(other.criterion))
        assert float(row["share_first"]) == pytest.approx(other.shares["first"])
        assert int(row["n"]) == one.n == (9 if block.block == "quest" else 24)
    of = defaultdict(list)
    for row in rows(exported, "thresholds", "levels"):
        of[row["block"]].append(row)
    assert [row["condition"] for row in of["pairs"]] == ["late"] * 3 + ["other"] * 3
    assert all(row["threshold"] == "n/a" and "n/a" not in (row["d_prime"], row["share_first"]) for row in of["pairs"])
    assert {(row["d_prime"], row["threshold"] == "n/a") for row in of["equal"]} == {("n/a", False)}
    assert all(row["criterion"] != "n/a" for row in of["detect"])
    assert of["rate"] == []


def test_a_sealed_study_exports_its_intervals_without_what_tells_a_level(sealed_levels: Path, tmp_path: Path) -> None:
    export(sealed_levels, tmp_path)
    sealed = {column.name for column in INTERVALS if column.sealed}
    assert {"level", "standard", "presented", "force_mean_n"} < sealed
    intervals = rows(tmp_path, "intervals", "levels")
    assert len(intervals) == 3 * (12 * 2 + 9 + 6 + 7 + 6 * 2 + 6 * 3 + 8 * 2)
    assert sealed.isdisjoint(intervals[0])
    assert not [path for path in tmp_path.iterdir() if re.search("tracks|thresholds|exponents|settings", path.name)]
    codebook = json.loads((tmp_path / "codebook.json").read_text())
    assert set(codebook["sealed_columns"]) >= sealed
    assert [one["block"] for one in codebook["levels"]] == BLOCKS
    assert "vary" not in codebook["levels"][0]


def test_the_report_of_a_sealed_study_shows_counts_and_times_by_code_and_no_level(
    sealed_levels: Path, tmp_path: Path
) -> None:
    report(sealed_levels, tmp_path)
    page = (tmp_path / "report.html").read_text()
    held = json.loads((tmp_path / "report.json").read_text())["results"]["levels"]
    assert page.count("Not yet revealed") == len(BLOCKS)
    assert {(len(one["answers"]), one["vary"], one["level_kind"]) for one in held} == {(0, None, None)}
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


def test_the_report_has_a_table_and_a_figure_of_every_block_that_name_quantities(reported_levels: Path) -> None:
    page = (reported_levels / "report.html").read_text()
    held = json.loads((reported_levels / "report.json").read_text())["results"]["levels"]
    assert [one["block"] for one in held] == BLOCKS
    for block in held:
        assert "SIMULATED participants" in (reported_levels / f"levels-{block['block']}.txt").read_text()
        assert {one["participant"] for one in block["answers"]} == {None, "P001", "P002", "P003"}
    assert (page.count("Answers at each level</h3>"), page.count("Time to answer</h3>")) == (6, 7)
    for words in ("share correct", "share “yes”", "Comparison [Pa·s]</th>"):
        assert words in page
    drawn = {path.stem: path.read_text(encoding="utf-8") for path in reported_levels.glob("*.svg")}
    for name, words in (
        ("levels-viscosity", "Weber fraction of viscosity<"),
        ("levels-viscosity", "standard 2 Pa·s<"),
        ("levels-number", "Viscosity [Pa·s]<"),
        ("levels-pairs", "Condition<"),
        ("question-viscosity-choice_2ifc", "Viscosity: Answer<"),
    ):
        assert words in drawn[name]
    assert not [words for svg in drawn.values() for words in re.findall(r">([^<>]+)</text>", svg) if "_" in words]


@pytest.mark.nightly
def test_plot_draws_the_questions_and_levels_of_a_study_without_statements(opened_levels: Path, tmp_path: Path) -> None:
    written = {path.name for path in plot(opened_levels, tmp_path)}
    assert {f"levels-{block}.{form}" for block in BLOCKS for form in ("png", "svg", "pdf", "txt")} < written
    assert "question-viscosity-choice_2ifc.png" in written
