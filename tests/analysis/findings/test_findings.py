"""Every finding in studies of every shape, and one that no file of the package names: a finding is one file."""

import csv
import io
import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import t as student

from study_app.analysis.data.study_tables import Study, load_study, pool_sites
from study_app.analysis.evaluate import evaluate
from study_app.analysis.findings import all_findings
from study_app.analysis.report import sections
from study_app.analysis.report.sections import answers
from study_app.analysis.report.write_report import report
from study_app.analysis.study_worker import carry_out
from study_app.analysis.worker_messages import FigureDrawn, ReadStudy
from study_app.store.unblinding import unblind
from tests.analysis.conftest import HIDDEN, SAMPLE, Results, twelve
from tests.analysis.made_up import ITEMS, delays, everybody, liquids, study
from tests.analysis.random_studies import drawn, keeps_contract
from tests.analysis.report.read_report import seen
from tests.plug_in_packages import forget, install

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]

TOY = Path(__file__).parent / "toy"
KEY = "highest_answers"
RANDOM = 12


def rising(_person: int, session: int, code: str, _item: str) -> int:
    draw = np.random.default_rng((_person, session, ord(code[-1])))
    return int(np.clip(round(int(code[1:]) + session + draw.normal()), 1, 7))


def made(count: int, people: int, *, kind: str = "delays", sessions: int = 1, repetitions: int = 1) -> Study:
    settings = liquids(count) if kind == "liquids" else delays([50.0 * place for place in range(count)])
    return study(settings, list(everybody(settings, people, rising, sessions=sessions, repetitions=repetitions)))


SHAPES = {
    "delays": made(4, 12),
    "liquids": made(3, 12, kind="liquids"),
    "two delays": made(2, 8),
    "two liquids": made(2, 8, kind="liquids"),
    "one setting": made(1, 8),
    "sessions and repetitions": made(4, 10, sessions=2, repetitions=2),
    "sites": pool_sites(Path("nowhere"), {"A": made(3, 6), "B": made(3, 6)}, ()),
    "five people": made(4, 5),
    "one person": made(3, 1, kind="liquids"),
    "nobody": made(3, 0),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_every_finding_keeps_its_contract_in_studies_of_every_shape(shape: str) -> None:
    results = keeps_contract(SHAPES[shape], forms=("png",))
    (found,) = results.blocks
    if shape in ("delays", "liquids"):
        due = {one.key for one in all_findings() if one.what and found.kind in one.kinds}
        tested = {one.key for one in all_findings() if one.value_in(found) != one.empty}
        assert tested == due - {"by_session"}


@pytest.mark.variants(6)
@pytest.mark.parametrize("number", range(RANDOM))
def test_every_finding_keeps_its_contract_in_random_studies(number: int) -> None:
    keeps_contract(drawn(np.random.default_rng(number)))


def test_while_sealed_findings_speak_of_codes_and_say_what_waits(rek: Results, small: Results) -> None:
    for sealed in (load_study(twelve(rek, people=6).folder), _small(small)):
        results = keeps_contract(sealed, forms=("png",))
        for found in results.blocks:
            assert found.names == tuple(one.code for one in found.settings)
            assert found.delays_ms == ()
            waiting = {one.what for one in all_findings() if found.kind in one.waits}
            assert {one.what for one in found.absent if "after unblinding" in one.why} == waiting
        assert all("answered after unblinding" in one.text for one in answers(results))
        assert {(one.code, one.delay_ms, one.achieved_ms) for one in results.delivered} == {(None, None, None)}
        assert results.performance is None
        assert not [word for word in HIDDEN if word in repr(results).lower()]


def _small(small: Results) -> Study:
    for person in range(1, 8):
        small.add(f"P{person:03d}", lambda condition, _item: 6 if condition == "heavyzembla" else 2)
    return load_study(small.folder)


@pytest.fixture
def toy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A finding of another package."""
    site = Path(shutil.copytree(TOY, tmp_path / "site"))
    monkeypatch.syspath_prepend(site)
    install(site, "toy_finding", "finding", {"highest": f"{KEY}:HighestAnswers"})
    forget()
    yield
    forget(KEY)


@pytest.mark.nightly
@pytest.mark.usefixtures("toy")
def test_a_finding_that_is_one_file_stands_in_every_output(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(SAMPLE.path, tmp_path / "sample"))
    unblind(folder, by="AB", reason="a test")
    report(folder, tmp_path, failed=pytest.fail)
    written = json.loads((tmp_path / "report.json").read_bytes())
    made = load_study(folder)
    rows = list(csv.DictReader(io.StringIO((tmp_path / "tests.csv").read_text("utf-8"))))
    page = (tmp_path / "report.html").read_text("utf-8")
    for block, told in zip(made.blocks, written["results"]["blocks"], strict=True):
        given = made.answers(block)
        sevens = given[given["response"] == 7]
        counts = {item.id: int((sevens["item"] == item.id).sum()) for item in block.items}
        assert {one["item"]: one["outcome"]["statistic"] for one in told[KEY]} == counts
        here = [row for row in rows if row["block"] == block.id and row["question"] == "the highest answer is given"]
        assert {row["item"]: float(row["statistic"]) for row in here} == counts
        assert {"what": "count of lowest answers", "why": "nobody asked for it"} in told["absent"]
        assert f"The highest answers of {block.title} were counted." in written["methods"]
    assert page.count("<h3>&lt;Highest&gt; answers, counted</h3>") == len(made.blocks)
    assert page.count("Which statement got most highest answers?") == len(made.blocks)
    assert page.count("&lt;Highest&gt; answers, as shares.") == 2 * len(made.blocks)  # caption and text of the picture
    for block in made.blocks:  # each has a file of its own
        assert (tmp_path / f"highest-{block.id}.svg").read_text("utf-8").startswith("<?xml")
    told_window: list[object] = []
    carry_out(ReadStudy(folder), told_window.append, lambda: False)
    drawn = {one.title for one in told_window if isinstance(one, FigureDrawn) and one.name.startswith("highest")}
    assert drawn == {"<Highest> answers"}


def test_mean_differences_are_shown_with_their_spread_and_interval() -> None:
    """Differences are those of the other liquids from the first one."""
    settings, given = liquids(3), np.random.default_rng(8).integers(1, 8, size=(17, 3, 2))
    trials = [
        (f"P{person:03}", 1, setting.code, given[person, place].tolist())
        for person in range(17)
        for place, setting in enumerate(settings)
    ]
    results = evaluate(study(settings, trials))
    (found,) = results.blocks
    told = seen("".join(sections.block(found, results, ())))
    assert len(set(found.names)) == 3
    for item, of_item in zip(ITEMS, np.moveaxis(given, 2, 0), strict=True):
        for other in (1, 2):
            differences = of_item[:, other] - of_item[:, 0]
            error = differences.std(ddof=1) / 17**0.5
            reach = student.ppf(0.975, 16) * error
            mean = differences.mean()
            numbers = (mean, differences.std(ddof=1), error, mean - reach, mean + reach)
            row = [item.capitalize(), f"{found.names[other]} − {found.names[0]}", "17", *map("{:.2f}".format, numbers)]
            assert " ".join(row).replace("-", "−") in told
