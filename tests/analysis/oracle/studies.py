"""Studies for the oracle: their sessions are simulated, and every measured column has drawn values, all different."""

import csv
import json
import random
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from study_app.analysis.report import study_figures, write_report
from study_app.protocol.load import load
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.exclusions import exclude
from study_app.store.files.columns import INTERVALS, RESPONSES, TRIALS
from study_app.store.files.folders import SessionFolder, StudyFolder
from study_app.store.sites.merge import merge_sites
from study_app.store.unblinding import unblind
from study_app.store.withdrawals import withdraw as erase
from tests.analysis.conftest import CANNOT_JUDGE, Answer, make_results
from tests.analysis.oracle.conduct import compare_captions, compare_conduct
from tests.analysis.oracle.levels import compare_hypotheses, compare_levels
from tests.analysis.oracle.recomputed import Compared, read_table
from tests.analysis.oracle.statements import compare_statements
from tests.analysis.outputs import figures_as_lines
from tests.studies import made_up

FILES = {
    "rek2024": Path("protocols/rek2024.toml"),
    **{name: Path(__file__).parent / f"{name}.toml" for name in ("levels", "groups")},
    "sites": Path(__file__).parent / "groups.toml",
}
ROOT = Path(__file__).resolve().parents[3]
NOT_MEASURED = frozenset({"part", "intervals", "targets", "setting", "standard", "level", "catch", "response", "value"})
MEASURED = {
    name: column.kind
    for name, column in {variable.name: variable for variable in (*RESPONSES, *INTERVALS, *TRIALS)}.items()
    if column.may_miss and column.kind in ("integer", "number", "flag") and name not in NOT_MEASURED
}
SPREAD = 0.05
"""Standard deviation of the logarithm of what is delivered of a number."""


@dataclass(frozen=True)
class Written:
    """A study's folder, its report, its file, and the folder of its list of exclusions."""

    study: Path
    report: Path
    file: Path

    @property
    def lists(self) -> Path:
        lists = self.study.parent / "lists"
        return lists if lists.exists() else self.study

    def compared(self) -> Compared:
        """Return the report with the numbers that the oracle recomputed."""
        compared, study = Compared(self.report), tomllib.loads((ROOT / self.file).read_text("utf-8"))
        names = ["responses", "trials", *(["intervals"] if [*self.report.glob("*intervals_data.csv")] else [])]
        answers, trials, *intervals = (read_table(self.report, name, self.lists) for name in names)
        compare_statements(compared, answers, trials)
        compare_conduct(compared, answers, trials)
        if intervals:
            compare_levels(compared, answers, intervals[0], study)
        compare_hypotheses(compared, trials, study)
        compared.check_tests()
        compare_captions(compared, trials)
        return compared


def write(name: str, study: Path, to: Path, *, figures: bool = False) -> Written:
    """Write the report of a study; its figures contain only texts, or are omitted."""
    with figures_as_lines(), pytest.MonkeyPatch.context() as patched:
        if not figures:
            for what in ("block", "summary", "level", "question"):
                patched.setattr(write_report, f"{what}_figure_tasks", lambda *_, **__: ())
        write_report.report(study, to, failed=pytest.fail)
    assert write_report.block_figure_tasks is study_figures.block_figure_tasks, (
        "a patch that stays would change later reports"
    )
    return Written(study, to, FILES[name])


def statements(folder: Path, name_of: Callable[[int], str] = "P{:03d}".format, key_seed: int = 3) -> Path:
    """Return the thesis' study; answers depend only on person, condition and statement."""
    results = make_results(folder / "study", load("rek2024"), key_seed=key_seed)
    for number in range(1, 13):

        def answer(condition: str, item: str, number: int = number) -> Answer:
            draw = random.Random(f"{number} {condition} {item}")  # noqa: S311 - reproducible
            if draw.random() < 0.03:
                return CANNOT_JUDGE
            if condition.startswith("delay_"):
                level = 2 + int(condition.removeprefix("delay_")) / 60
            else:
                level = 5 if item == f"like_{condition}" else 3 + 0.3 * len(condition)
            return max(1, min(7, round(draw.gauss(level, 1.2))))

        results.add(name_of(number), answer)
    results.exclude(name_of(4), trial=results.trial(name_of(4), "honey"))
    results.open()
    draw_measurements(results.folder)
    return results.folder


def levels(folder: Path) -> Path:
    """Return a study of thresholds of two groups."""
    study = rehearse_answers(FILES["levels"], participants=6, seed=4, results=folder / "study", features={})
    unblind(study, "AB", "to analyse")
    draw_measurements(study)
    return study


def groups(folder: Path) -> Path:
    """Return a study of two groups with forms; a session and a trial are excluded, and one session is unfinished."""
    file = FILES["groups"]
    study = rehearse_answers(file, participants=14, seed=4, results=folder / "study", features=made_up(str(file)))
    exclude(study, "P003", 1, by="AB", reason="asleep")
    exclude(study, "P005", 1, trial=2, by="AB", reason="cough")
    unblind(study, "AB", "to analyse")
    draw_measurements(study)
    withdraw(StudyFolder(study).session("P008", 1))
    return study


def sites(folder: Path) -> Path:
    """Return a study of two sites with a key and an exclusion each; one site has a withdrawn participant."""
    file, site_entries = FILES["sites"], []
    for site, people, seed in (("north", 8, 4), ("south", 7, 9)):
        own = rehearse_answers(file, participants=people, seed=seed, results=folder / site, features=made_up(str(file)))
        trial = None if site == "north" else 2
        exclude(own, "P003", 1, trial=trial, by="AB", reason="asleep")
        site_entries.append({"participant": f"{site}-P003", "session": "1", "trial": str(trial or "n/a")})
        if site == "south":
            erase(own, "P005", by="CD", reason="asked for it")
        unblind(own, "AB", "to analyse")
        draw_measurements(own, seed)
    (folder / "lists").mkdir()
    write_rows(folder / "lists" / "exclusions.csv", site_entries)
    merge_sites({"north": folder / "north", "south": folder / "south"}, folder / "study")
    return folder / "study"


def withdraw(session: SessionFolder, trials: int = 3) -> None:
    """Let a participant have withdrawn after so many trials."""
    known = json.loads(session.receipt.read_text("utf-8"))
    session.receipt.write_text(json.dumps(known | {"status": "withdrawn"}), "utf-8")
    for path in session.path.glob("*_data.csv"):
        head, *rows = list(csv.reader(path.read_text("utf-8").splitlines()))
        kept_rows = [row for row in rows if row[head.index("trial")] in ("n/a", *map(str, range(1, trials + 1)))]
        write_rows(path, [dict(zip(head, row, strict=True)) for row in kept_rows])


def draw_measurements(study: Path, seed: int = 1) -> None:
    """Draw all that is measured in trials, intervals and answers; delivered numbers are near the requested ones."""
    draw = np.random.default_rng(seed)
    for path in sorted((study / "data").rglob("*_data.csv")):
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        for row in rows:
            for name in (name for name in row if name in MEASURED):
                row[name] = _drawn(MEASURED[name], draw)
            if "value_delivered" in row:
                row["value_delivered"] = repr(_requested(row) * float(np.exp(SPREAD * draw.normal())))
        write_rows(path, rows)


def write_rows(path: Path, rows: list[dict[str, str]]) -> None:
    """Write a table as the program does."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def _drawn(kind: str, draw: np.random.Generator) -> str:
    if kind == "flag":
        return "true" if draw.random() < 0.8 else "false"
    return str(draw.integers(1, 10**9)) if kind == "integer" else repr(float(draw.uniform(0.01, 0.99)))


def _requested(row: dict[str, str]) -> float:
    """Return the number that an interval was to present."""
    if row["standard"] == "n/a":
        return float(row["level"])
    return float(row["standard"]) * (1 + float(row["level"]) * (row["presented"] == "comparison"))
