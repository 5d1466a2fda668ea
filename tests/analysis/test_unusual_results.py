"""The report and export of unusual results folders: their words, compared with reviewed files; no table is broken."""

import csv
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from study_app.analysis.data.study_tables import load_study
from study_app.analysis.export_study import export
from study_app.protocol.load import load, parse
from study_app.protocol.simulated import NO_FEATURES
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.sites.merge import merge_sites
from study_app.store.unblinding import unblind, unblind_folder
from tests.analysis.conftest import CANNOT_JUDGE, SMALL, Results, make_results
from tests.analysis.levels.level_studies import ADAPTIVE, matching_file
from tests.analysis.outputs import GOLDEN, figures_as_lines, report_words, sav_labels
from tests.golden import CHANGING, compare, each_once
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


def with_exclusions(folder: Path) -> Path:
    results = make_results(folder / "r", load("rek2024"), simulated=False)
    for number, changes in enumerate(({"valid": False}, {"valid": None}, {"delay_error_mean_ms": -2.25}, {}), start=1):
        results.add(f"P{number}", lambda c, i, n=number: 1 + (n + len(c + i)) % 7, changes=changes)
    results.add("P5", lambda *_: 6, status="withdrawn", trials=3)
    results.add("P6", lambda *_: 7, session=2, repeated={"L1": lambda *_: 1, "D2": lambda *_: None})
    results.exclude("P1", reason="held the\nwrong  handle, " + "very " * 40)
    results.exclude("P2", trial=results.trial("P2", "honey"), reason="the phone rang")
    results.open()
    return results.folder


def rehearsed(
    make: Callable[[Path], Path], people: int, *, seed: int = 3, features: bool = True
) -> Callable[[Path], Path]:
    def study(folder: Path) -> Path:
        file = make(folder)
        moved = made_up(str(file)) if features else {}
        results = rehearse_answers(file, participants=people, seed=seed, results=folder / "r", features=moved)
        unblind(results, "AB", "to analyse")
        return results

    return study


def adaptive_file(folder: Path) -> Path:
    (folder / "adaptive.toml").write_text(
        text_of_damper(
            "adaptive", ADAPTIVE.replace('method = "', 'catch = { share = 0.3, wrong_most = 0.5 }\nmethod = "'), (4, 8)
        ),
        encoding="utf-8",
        newline="\n",
    )
    return folder / "adaptive.toml"


def grouped(folder: Path) -> Path:
    (folder / "grouped.toml").write_text(STUDY + GROUPS, encoding="utf-8", newline="\n")
    features = {(block, condition): (NO_FEATURES,) for block in ("thin", "thick") for condition in ("water", "honey")}
    results = rehearse_answers(folder / "grouped.toml", participants=4, seed=2, results=folder / "r", features=features)
    unblind(results, "AB", "to analyse")
    return results


def sites_of_statements(folder: Path) -> Path:
    features = made_up("rek2024")
    folders = {
        site: rehearse_answers("rek2024", participants=2, seed=seed, results=folder / site, features=features)
        for seed, site in enumerate("AB", start=1)
    }
    merge_sites(folders, folder / "pooled")
    unblind_folder(folder / "pooled", "AK", "closed")
    return folder / "pooled"


QUICK = {"one_sealed": one_sealed, "unfinished": unfinished}
SLOW = {
    "matching": rehearsed(matching_file, 2), "excluded": with_exclusions, "mixed": rehearsed(mixed_file, 2),
    "grouped": grouped, "adaptive": rehearsed(adaptive_file, 2, features=False),
    "sites_of_statements": sites_of_statements,
}  # fmt: skip
EXTRAS = {"mixed": ["wide", "psych-ds", "sav"]}


@pytest.mark.parametrize("name", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)])
def test_the_outputs_of_unusual_results(name: str, tmp_path: Path, pytestconfig: pytest.Config) -> None:
    folder = (QUICK | SLOW)[name](tmp_path)
    lines = list(report_words(load_study(folder)))
    with figures_as_lines():
        exported_files = export(folder, tmp_path / "out", extras=EXTRAS.get(name, ["wide"]))
    for file, path in sorted({path.name: path for path in exported_files}.items()):
        if path.suffix == ".csv":
            (width,) = {len(row) for row in csv.reader(path.read_text(encoding="utf-8").splitlines(keepends=True))}
            assert width > 1, file
        if name in EXTRAS and path.suffix == ".sav":
            lines += sav_labels(path)
    if name == "one_sealed":
        assert not any(re.search(r"\b(water|honey)\b", line, re.I) for line in lines), "the key is sealed"
    if name == "sites_of_statements":
        lines = [line for line in lines if re.search(r"\bsites?\b", line, re.I)]
    compare(GOLDEN / f"results-{name}.txt", each_once(lines), pytestconfig, mask=CHANGING)
