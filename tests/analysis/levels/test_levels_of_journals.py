"""What is found, reported and exported of blocks of levels is what journals hold; while sealed, nothing tells it."""

import csv
import json
import re
import shutil
from collections import defaultdict
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import pyreadstat
import pytest

from study_app.analysis.data.study_tables import load_study
from study_app.analysis.export.tables import wide_table
from study_app.analysis.export_study import export
from study_app.analysis.levels.evaluate import level_methods, level_results
from study_app.analysis.levels.statistic import statistics
from study_app.analysis.levels.tracks import OF_INTERVALS
from study_app.analysis.report.first_page import presented_in
from study_app.analysis.report.write_report import report
from study_app.protocol.load import load
from study_app.store.blinded.blinding import complete_protocol, open_events, read_key
from study_app.store.files.columns import INTERVALS, TRIALS_MISSING
from study_app.store.files.csv_files import csv_bytes, read_table
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.receipt import read
from study_app.store.verification.leaks import certain_telltales, presented_numbers
from tests.journal_lines import raw

pytestmark = pytest.mark.slow

NAMED = "study-levels_description-"
BLOCKS = ["viscosity", "detect", "rate", "number", "equal", "odd", "pairs"]


class Answered(NamedTuple):
    """A trial of a journal: its start line and its answer."""

    participant: str
    started: dict[str, Any]
    value: Any
    response_s: float

    @property
    def right(self) -> bool:
        """Return whether the answer names the comparison: yes, its interval, or the odd interval."""
        arrangement = self.started["arrangement"]
        if len(arrangement) == 1:
            return bool((self.value == "yes") == (arrangement == "C"))
        odd = "C" if arrangement.count("C") == 1 else "S"
        return bool(["first", "second", "third"].index(self.value) == arrangement.index(odd))


def answered_trials_of(folder: Path, block: str) -> list[Answered]:
    answered_trials = []
    key = read_key(folder)
    for session in StudyFolder(folder).sessions():
        start_lines: dict[int, dict[str, Any]] = {}
        for line in raw(open_events(journal.read(session.journal), key)):
            if line["event"] == "trial_started" and line["block"] == block:
                start_lines[line["trial"]] = line
            elif line["event"] == "responses" and line["trial"] in start_lines:
                (item,) = line["items"]
                seconds = item["first_s"] - item["onset_s"]
                answered_trials.append(
                    Answered(session.participant, start_lines[line["trial"]], item["value"], seconds)
                )
    return answered_trials


def rows(folder: Path, name: str) -> list[dict[str, str]]:
    with (folder / f"{NAMED}{name}_data.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_an_interval_that_no_trial_reached_has_empty_cells(opened_levels: Path, tmp_path: Path) -> None:
    shutil.copytree(opened_levels, tmp_path / "study")
    for name, query in {"responses": "participant == ''", "intervals": "interval == '1'"}.items():
        for path in (tmp_path / "study").rglob(f"*{name}_data.csv"):
            pd.read_csv(path, dtype=str, keep_default_na=False).query(query).to_csv(path, index=False)
    export(tmp_path / "study", tmp_path / "tables")
    tracks = rows(tmp_path / "tables", "tracks")
    assert [row["force_mean_n_2"] for row in tracks] == ["n/a"] * 3 * 54


def test_trials_of_tracks_have_the_condition_whose_number_is_varied(opened_levels: Path, tmp_path: Path) -> None:
    export(opened_levels, tmp_path)
    for name in ("trials", "tracks"):
        of = {(row["block"], row["condition"], row["liquid"], row["delay_ms"]) for row in rows(tmp_path, name)}
        assert {("equal", "oil", "thin", "0.0"), ("pairs", "late", "thin", "100.0")} <= of, name
        assert not any("/" in condition or delay == "n/a" for _, condition, _, delay in of), name
    (tracks, *_), (response, *_) = rows(tmp_path, "tracks"), rows(tmp_path, "responses")
    assert {f"{name}_{number}" for name in OF_INTERVALS for number in (1, 2, 3)} <= tracks.keys()
    assert TRIALS_MISSING.name in response
    blocks = load_study(opened_levels).levels
    levels = json.loads((tmp_path / "codebook.json").read_text("utf-8"))["levels"]
    varied = {block.id: block.stimulus for block in blocks if block.stimulus is not None}
    assert {
        level["block"]: (level["vary"], level["level"], level["direction"]) for level in levels if "vary" in level
    } == {name: (stimulus.vary, stimulus.level_kind, stimulus.direction) for name, stimulus in varied.items()}


def test_tables_of_levels_hold_measures_and_results_in_every_format(opened_levels: Path, tmp_path: Path) -> None:
    """Forces and speeds of intervals are drawn, all different."""
    folder, drawn_bars = shutil.copytree(opened_levels, tmp_path / "study"), dict[tuple[str, str, str], float]()
    for session in StudyFolder(folder).sessions():
        path = session.table("levels", "intervals")
        table = read_table(path.read_bytes(), INTERVALS)
        for row in table:
            for name in OF_INTERVALS:
                row[name] = cell = (len(drawn_bars) + 1) / 8
                drawn_bars[session.participant, str(row["trial"]), f"{name}_{row['interval']}"] = cell
        path.write_bytes(csv_bytes(INTERVALS, table))
    to, study = tmp_path / "out", load_study(folder)
    export(folder, to, extras=["parquet", "sav"])
    files = json.loads((to / "codebook.json").read_text("utf-8"))["files"]
    columns = {column["name"]: column["description"] for column in files[f"{NAMED}tracks_data.csv"]}
    descriptions = {column.name: column.description for column in INTERVALS if column.name in OF_INTERVALS}
    for row in rows(to, "tracks"):
        for name, number in product(OF_INTERVALS, (1, 2, 3)):
            cell = drawn_bars.get((row["participant"], row["trial"], f"{name}_{number}"))
            assert row[f"{name}_{number}"] == ("n/a" if cell is None else str(cell))
            assert columns[f"{name}_{number}"] == f"{descriptions[name]} In interval {number}."
    about = {"study": "levels", "simulated": True, "pilot": False, "group": None}
    expected: dict[str, list[Any]] = {"tracks": [], "responses": []}
    for result, statistic in product(level_results(study), statistics()):
        if statistic.is_exported_in(study):
            expected.setdefault(statistic.table, []).extend(about | row for row in statistic(result).export_rows())
    assert expected.keys() == {path.stem.partition("tion-")[2].removesuffix("_data") for path in to.glob("*.sav")} - {
        "wide"
    }
    for table, results in expected.items():
        path = to / f"{NAMED}{table}_data.parquet"
        frame, sav_frame = pd.read_parquet(path), pyreadstat.read_sav(str(path.with_suffix(".sav")))[0]
        names = [column["name"] for column in files[f"{path.stem}.csv"]]
        assert [*frame] == [*sav_frame] == names
        cells = [[None if pd.isna(cell) else cell for cell in row] for row in frame.astype(object).to_numpy()]
        assert [
            [None if pd.isna(cell) or cell == "" else cell for cell in row] for row in sav_frame.to_numpy()
        ] == cells
        cell_texts = [[csv_text(cell) for cell in row] for row in cells]
        assert cell_texts == [[*row.values()] for row in rows(to, table)]
        assert not results or cells == [[row[name] for name in names] for row in results]


def csv_text(cell: Any) -> str:
    """Return the CSV text of a cell."""
    return "n/a" if cell is None else str(cell).lower() if isinstance(cell, bool) else str(cell)


def test_answers_of_tracks_are_not_in_the_wide_table(opened_levels: Path) -> None:
    assert [column.name for column in wide_table(load_study(opened_levels))[0].columns] == ["participant", "simulated"]


def test_the_tracks_table_has_a_row_per_trial_with_the_presented_level(opened_levels: Path, tmp_path: Path) -> None:
    export(opened_levels, tmp_path)
    tracks, key = rows(tmp_path, "tracks"), read_key(opened_levels)
    assert len(tracks) == 3 * 54
    people = sorted({row["participant"] for row in tracks})
    estimated = [(row["block"], row["participant"]) for row in rows(tmp_path, "exponents")]
    assert sorted(estimated) == [("number", participant) for participant in people]
    of_trial = {(row["participant"], row["trial"]): row for row in tracks}
    for block in BLOCKS:
        for answer in answered_trials_of(opened_levels, block):
            row, line = of_trial[answer.participant, str(answer.started["trial"])], answer.started
            assert (row["block"], row["arrangement"]) == (block, line["arrangement"])
            assert row["track"] == key.codes[block][line["code"]]
            assert row["level_asked"] == ("n/a" if line["level"] is None else str(line["level"]))
            assert row["standard"] == ("n/a" if line["standard"] is None else str(line["standard"]))
            assert row["response_s"] == str(round(answer.response_s, 6))
            has_answers = block in ("viscosity", "pairs", "detect", "odd")
            assert row["right"] == (str(answer.right).lower() if has_answers else "n/a"), block
            modulus = block == "number" and row["index"] == "1"
            assert row["analysed"] == str(not modulus).lower()
    assert {int(row["slot"]) for row in tracks if row["block"] == "viscosity"} == set(range(1, 7))
    letters: dict[tuple[str, str], str] = defaultdict(str)
    for row in rows(tmp_path, "intervals"):
        letters[row["participant"], row["trial"]] += {"standard": "S", "comparison": "C"}[row["presented"]]
    assert letters == {which: row["arrangement"] for which, row in of_trial.items()}


def test_intervals_are_exported_without_sealed_columns_before_unblinding(sealed_levels: Path, tmp_path: Path) -> None:
    export(sealed_levels, tmp_path)
    sealed = {column.name for column in INTERVALS if column.sealed}
    assert {"level", "standard", "presented", "force_mean_n"} < sealed
    intervals = rows(tmp_path, "intervals")
    assert len(intervals) == 3 * (12 * 2 + 9 + 6 + 7 + 6 * 2 + 6 * 3 + 8 * 2)
    assert sealed.isdisjoint(intervals[0])
    assert not [path for path in tmp_path.iterdir() if re.search("tracks|thresholds|exponents|settings", path.name)]
    codebook = json.loads((tmp_path / "codebook.json").read_text("utf-8"))
    assert set(codebook["sealed_columns"]) >= sealed
    assert [level_block["block"] for level_block in codebook["levels"]] == BLOCKS
    designs = ["2ifc", "yesno", "rating", "estimation", "2ifc", "oddity", "2ifc"]
    for entry, block, design in zip(codebook["levels"], BLOCKS, designs, strict=True):
        item = {"2ifc": "choice_2ifc"}.get(design, design)
        description = [entry[key] for key in ("title", "phase", "design", "item")]
        assert description == [block.capitalize(), "main", design, item]
    assert "vary" not in codebook["levels"][0]


def test_the_methods_state_the_trials_the_unit_and_the_modulus(opened_levels: Path) -> None:
    study = load_study(opened_levels)
    words = " ".join(level_methods(study.levels, level_results(study)))
    number, rate = "magnitude estimation, 6 trials per participant", "ratings, 6 trials per participant"
    for title, design in (("Number", number), ("Rate", rate)):
        assert f"In “{title}” ({design}), viscosity was judged at values of 0.5, 2 and 8 Pa·s; " in words
    (sentence,) = [presentation.sentence for block, presentation in presented_in(study).items() if block == "number"]
    assert f"In the block “Number” ({number}), " in sentence, "without the modulus"
    modulus = "a level of 2 Pa·s was presented as the modulus, to which the number 10 was assigned."
    assert words.count(modulus) == 1


@pytest.mark.usefixtures("png_figures_only")
def test_the_report_before_unblinding_shows_counts_and_times_by_code_but_not_the_levels(
    sealed_levels: Path, tmp_path: Path
) -> None:
    report(sealed_levels, tmp_path)
    page = (tmp_path / "report.html").read_text("utf-8")
    content = json.loads((tmp_path / "report.json").read_text("utf-8"))["results"]["levels"]
    assert page.count("appear here after unblinding") == len(BLOCKS)
    assert {
        (len(level_block["answers"]), level_block["vary"], level_block["level_kind"]) for level_block in content
    } == {(0, None, None)}
    assert sum(times["numbers"]["n"] for level_block in content for times in level_block["times"]) == 3 * 54
    assert not list(tmp_path.glob("levels-*"))
    key = read_key(sealed_levels)
    published = read(StudyFolder(sealed_levels).sessions()[0].receipt)["protocol"]
    levels = presented_numbers(complete_protocol(published, key))
    assert levels == presented_numbers(load(str(sealed_levels.parent / "levels.toml")))
    words = certain_telltales(key.tables, published, levels)
    for path in tmp_path.iterdir():
        if path.suffix in {".html", ".json", ".txt", ".csv", ".R"}:
            revealed_words = words.in_text(path.read_text(encoding="utf-8"))
            assert [word for word in revealed_words if word != "other"] == [], (
                path.name
            )  # a condition, and an English word
    assert "viscosity_pa_s" not in page


def test_each_estimate_on_the_first_page_is_beside_its_figure(reported_levels: Path) -> None:
    page = (reported_levels / "report.html").read_text(encoding="utf-8")
    cards = re.findall(r'<article class="card.*?</article>', page, re.S)
    assert len(cards) >= len(BLOCKS)
    assert [card for card in cards if '<div class="shown">' not in card] == []
