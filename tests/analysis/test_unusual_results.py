"""The whole report and export of unusual results folders, compared with reviewed files."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from study_app.analysis.data.study_tables import load_study
from study_app.analysis.export.export import export
from study_app.protocol.load import load, parse
from study_app.protocol.simulated_observer import NO_FEATURES
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.blinded.unblinding import unblind, unblind_folder
from study_app.store.sites.merge import merge
from tests.analysis.conftest import CANNOT_JUDGE, SMALL, Results, make_results
from tests.analysis.levels.level_studies import ADAPTIVE, matching_file
from tests.analysis.outputs import ELSEWHERE, GOLDEN, figures_as_lines, report_lines
from tests.golden import compare, file_lines
from tests.protocol.forms.mixed import mixed_file
from tests.protocol.groups.grouped import GROUPS, STUDY
from tests.protocol.trials.level_studies import text_of_damper
from tests.studies import made_up


def small(folder: Path) -> Results:
    return make_results(folder / "r", parse(SMALL.encode(), "small.toml"))


def one_sealed(folder: Path) -> Path:
    results = small(folder)
    results.add("P001", lambda condition, item: 3 if item == "smooth" else CANNOT_JUDGE)
    return results.folder


def unfinished(folder: Path) -> Path:
    results = small(folder)
    results.add("P001", lambda *_: 4, status="withdrawn", trials=2)
    results.open()
    return results.folder


def excluded(folder: Path) -> Path:
    results = make_results(folder / "r", load("rek2024"), simulated=False)
    for number, changes in enumerate(({"valid": False}, {"valid": None}, {"delay_error_mean_ms": -2.25}, {}), start=1):
        results.add(f"P{number}", lambda c, i, n=number: 1 + (n + len(c + i)) % 7, changes=changes)
    results.add("P5", lambda *_: 6, status="withdrawn", trials=3)
    results.add("P6", lambda *_: 7, session=2, repeated={"L1": lambda *_: 1, "D2": lambda *_: None})
    results.exclude("P1", reason="held the\nwrong  handle, " + "very " * 40)
    results.exclude("P2", trial=results.trial("P2", "honey"), reason="the phone rang")
    results.open()
    return results.folder


def many_excluded(folder: Path) -> Path:
    results = small(folder)
    for number in range(1, 24):
        results.add(f"P{number:02d}", lambda c, i: None if i == "warm" else 4)
        if number > 1:
            results.exclude(f"P{number:02d}", reason=f"reason {number}")
    path = results.responses("P01")
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:-1]))
    results.open()
    return results.folder


def rehearsed(make: Callable[[Path], Path], people: int, *, seed: int = 3, felt: bool = True) -> Callable[[Path], Path]:
    def study(folder: Path) -> Path:
        file = make(folder)
        moved = made_up(str(file)) if felt else {}
        results = rehearse_answers(file, participants=people, seed=seed, results=folder / "r", felt=moved)
        unblind(results, "AB", "to analyse")
        return results

    return study


def adaptive_file(folder: Path) -> Path:
    (folder / "adaptive.toml").write_text(
        text_of_damper(
            "adaptive", ADAPTIVE.replace('method = "', 'catch = { share = 0.3, wrong_most = 0.5 }\nmethod = "'), (4, 8)
        )
    )
    return folder / "adaptive.toml"


def grouped(folder: Path) -> Path:
    (folder / "grouped.toml").write_text(STUDY + GROUPS)
    felt = {(block, condition): (NO_FEATURES,) for block in ("thin", "thick") for condition in ("water", "honey")}
    results = rehearse_answers(folder / "grouped.toml", participants=4, seed=2, results=folder / "r", felt=felt)
    unblind(results, "AB", "to analyse")
    return results


def sites_of_statements(folder: Path) -> Path:
    felt = made_up("rek2024")
    folders = {
        site: rehearse_answers("rek2024", participants=2, seed=seed, results=folder / site, felt=felt)
        for seed, site in enumerate("AB", start=1)
    }
    merge(folders, folder / "pooled")
    unblind_folder(folder / "pooled", "AK", "closed")
    return folder / "pooled"


QUICK = {"one_sealed": one_sealed, "unfinished": unfinished, "matching": rehearsed(matching_file, 2)}
SLOW = {
    "excluded": excluded, "many_excluded": many_excluded, "mixed": rehearsed(mixed_file, 2), "grouped": grouped,
    "adaptive": rehearsed(adaptive_file, 2, felt=False), "sites_of_statements": sites_of_statements,
}  # fmt: skip
SHARED = {"many_excluded", "mixed"}
"""Studies that are exported as Psych-DS too."""
CELLS = 40
"""Most cells of a column that are compared."""
COLUMN = re.compile(r"\w+: \[")
REPEATED = re.compile(r"/results/blocks/\d+/measures/|/files/\S+-wide_data\.csv/")
"""Lines of report and codebook that tables and descriptions of Psych-DS hold too."""


def shortened(line: str) -> str:
    """Return a column of a table with at most the first and the last cells."""
    cells = line.split(", ")
    if len(cells) <= CELLS or not COLUMN.match(line):
        return line
    return ", ".join([*cells[: CELLS // 2], f"{len(cells)} in all", *cells[-CELLS // 2 :]])


@pytest.mark.parametrize("name", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)])
def test_the_outputs_of_unusual_results(name: str, tmp_path: Path, pytestconfig: pytest.Config) -> None:
    folder = (QUICK | SLOW)[name](tmp_path)
    lines, told = list(report_lines(load_study(folder), ELSEWHERE | {"tests.csv"})), {"report.json"}
    with figures_as_lines():
        written = export(folder, tmp_path / "out", extras=["wide", *(["psych-ds"] if name in SHARED else [])])
    for path in sorted(written):
        if (path.suffix == ".json" or "description-wide" in path.name) and path.name not in told:
            told.add(path.name)
            lines += [f"##### export {path.name}", *file_lines(path.name, path.read_bytes())]
    kept = (shortened(line) for line in lines if not REPEATED.match(line))
    compare(GOLDEN / f"results-{name}.txt", kept, pytestconfig)
