"""The report of a study of statements, recomputed from its tables by code that shares nothing with the program."""

import json
import random
from pathlib import Path

import pytest

from study_app.analysis.report.write_report import report
from study_app.protocol.load import load
from tests.analysis.conftest import CANNOT_JUDGE, Answer, make_results
from tests.analysis.oracle.statements import compare
from tests.studies import once

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]

RECOMPUTED = 0.6
"""Least share of the numbers of this report; those that are not recomputed are printed by name."""


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report of twelve people who notice delays, and who differ in how long and how strongly they stirred."""

    def make(folder: Path) -> None:
        results = make_results(folder / "rek2024", load("rek2024"))
        for number in range(1, 13):
            draw = random.Random(number)  # noqa: S311 - reproducible

            def answer(condition: str, _item: str, draw: random.Random = draw) -> Answer:
                if draw.random() < 0.03:
                    return CANNOT_JUDGE
                delay_ms = int(condition.removeprefix("delay_")) if condition.startswith("delay_") else 80
                return max(1, min(7, round(draw.gauss(2 + delay_ms / 60, 1.2))))

            measured = {name: round(draw.uniform(1, 9), 3) for name in ("duration_s", "path_length_m", "force_mean_n")}
            results.add(f"P{number:03d}", answer, changes={**measured, "ticks": 9000, "limiter_norm": number**2})
        results.open()
        report(results.folder, folder / "report")

    return once(tmp_path_factory, "oracle", make) / "report"


def test_no_number_differs_and_most_are_recomputed(written: Path) -> None:
    compared = compare(written)
    lines = [f"{100 * compared.share:.1f} % of the numbers of report.json were recomputed; these were not:"]
    lines += [f"{count:6d} {name}" for name, count in compared.missing().most_common()]
    print("\n".join(lines))  # noqa: T201 - pytest shows it with -s, or if the test fails
    assert compared.differences == []
    assert compared.share >= RECOMPUTED


@pytest.mark.parametrize(
    "path",
    [
        ("blocks", 0, "measures", 3, "q1"),
        ("blocks", 1, "against", 2, "found", "p_upper"),
        ("blocks", 1, "against", 2, "found", "interval", "low"),
        ("performance", "moved", 4, "median"),
    ],
)
def test_a_number_that_is_off_by_a_thousandth_is_found(
    written: Path, tmp_path: Path, path: tuple[str | int, ...]
) -> None:
    for table in written.glob("*_data.csv"):
        (tmp_path / table.name).symlink_to(table)
    changed = json.loads((written / "report.json").read_text(encoding="utf-8"))
    part = changed["results"]
    for key in path[:-1]:
        part = part[key]
    part[path[-1]] += 1e-3 * max(1.0, abs(part[path[-1]]))
    (tmp_path / "report.json").write_text(json.dumps(changed), encoding="utf-8")
    differences = compare(tmp_path).differences
    assert [place for place, _, _ in differences] == ["results." + ".".join(map(str, path))]
