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
from tests.plug_in_packages import forget_plug_ins, install

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]

TOY = Path(__file__).parent / "toy"
KEY = "highest_answers"
RANDOM = 12


def rising(_person: int, session: int, code: str, _item: str) -> int:
    draw = np.random.default_rng((_person, session, ord(code[-1])))
    return int(np.clip(round(int(code[1:]) + session + draw.normal()), 1, 7))


def made_up_study(count: int, people: int, *, kind: str = "delays", sessions: int = 1, repetitions: int = 1) -> Study:
    settings = liquids(count) if kind == "liquids" else delays([50.0 * place for place in range(count)])
    return study(settings, list(everybody(settings, people, rising, sessions=sessions, repetitions=repetitions)))


SHAPES = {
    "delays": made_up_study(4, 12),
    "liquids": made_up_study(3, 12, kind="liquids"),
    "two delays": made_up_study(2, 8),
    "two liquids": made_up_study(2, 8, kind="liquids"),
    "one setting": made_up_study(1, 8),
    "sessions and repetitions": made_up_study(4, 10, sessions=2, repetitions=2),
    "sites": pool_sites(Path("nowhere"), {"A": made_up_study(3, 6), "B": made_up_study(3, 6)}, ()),
    "five people": made_up_study(4, 5),
    "one person": made_up_study(3, 1, kind="liquids"),
    "nobody": made_up_study(3, 0),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_every_finding_keeps_its_contract_in_studies_of_every_shape(shape: str) -> None:
    results = keeps_contract(SHAPES[shape], forms=("png",))
    (block_result,) = results.blocks
    if shape in ("delays", "liquids"):
        due = {finding.key for finding in all_findings() if finding.what and block_result.kind in finding.kinds}
        tested = {finding.key for finding in all_findings() if finding.value_in(block_result) != finding.empty}
        assert tested == due - {"by_session"}


@pytest.mark.variants(6)
@pytest.mark.parametrize("number", range(RANDOM))
def test_every_finding_keeps_its_contract_in_random_studies(number: int) -> None:
    keeps_contract(drawn(np.random.default_rng(number)))


def test_findings_before_unblinding_use_codes_and_list_the_pending_tests(rek: Results, small: Results) -> None:
    for sealed in (load_study(twelve(rek, people=6).folder), _small(small)):
        results = keeps_contract(sealed, forms=("png",))
        for block_result in results.blocks:
            assert block_result.names == tuple(setting.code for setting in block_result.settings)
            assert block_result.delays_ms == ()
            waiting = {finding.what for finding in all_findings() if block_result.kind in finding.waits}
            assert {absence.what for absence in block_result.absent if "after unblinding" in absence.why} == waiting
        assert all("answered after unblinding" in answer.text for answer in answers(results))
        assert {(delivery.code, delivery.delay_ms, delivery.achieved_ms) for delivery in results.delivered} == {
            (None, None, None)
        }
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
    forget_plug_ins()
    yield
    forget_plug_ins(KEY)


@pytest.mark.nightly
@pytest.mark.usefixtures("toy")
def test_a_finding_defined_in_one_file_appears_in_every_output(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(SAMPLE.path, tmp_path / "sample"))
    unblind(folder, by="AB", reason="a test")
    report(folder, tmp_path, failed=pytest.fail)
    content = json.loads((tmp_path / "report.json").read_bytes())
    study = load_study(folder)
    rows = list(csv.DictReader(io.StringIO((tmp_path / "tests.csv").read_text("utf-8"))))
    page = (tmp_path / "report.html").read_text("utf-8")
    for block, block_json in zip(study.blocks, content["results"]["blocks"], strict=True):
        block_answers = study.answers(block)
        sevens = block_answers[block_answers["response"] == 7]
        counts = {item.id: int((sevens["item"] == item.id).sum()) for item in block.items}
        assert {row["item"]: row["outcome"]["statistic"] for row in block_json[KEY]} == counts
        here = [row for row in rows if row["block"] == block.id and row["question"] == "the highest answer is given"]
        assert {row["item"]: float(row["statistic"]) for row in here} == counts
        assert {"what": "count of lowest answers", "why": "nobody asked for it"} in block_json["absent"]
        assert f"The highest answers of {block.title} were counted." in content["methods"]
    assert page.count("<h3>&lt;Highest&gt; answers, counted</h3>") == len(study.blocks)
    assert page.count("Which statement got most highest answers?") == len(study.blocks)
    assert page.count("&lt;Highest&gt; answers, as shares.") == 2 * len(study.blocks)  # caption and text of the picture
    for block in study.blocks:  # each has a file of its own
        assert (tmp_path / f"highest-{block.id}.svg").read_text("utf-8").startswith("<?xml")
    told_window: list[object] = []
    carry_out(ReadStudy(folder), told_window.append, lambda: False)
    titles = {
        figure.title for figure in told_window if isinstance(figure, FigureDrawn) and figure.name.startswith("highest")
    }
    assert titles == {"<Highest> answers"}


def test_mean_differences_are_shown_with_their_spread_and_interval() -> None:
    """Differences are between the other liquids and the first one."""
    settings, ratings = liquids(3), np.random.default_rng(8).integers(1, 8, size=(17, 3, 2))
    trials = [
        (f"P{person:03}", 1, setting.code, ratings[person, place].tolist())
        for person in range(17)
        for place, setting in enumerate(settings)
    ]
    results = evaluate(study(settings, trials))
    (block_result,) = results.blocks
    visible_text = seen("".join(sections.block(block_result, results, ())))
    assert len(set(block_result.names)) == 3
    for item, of_item in zip(ITEMS, np.moveaxis(ratings, 2, 0), strict=True):
        for other in (1, 2):
            differences = of_item[:, other] - of_item[:, 0]
            error = differences.std(ddof=1) / 17**0.5
            reach = student.ppf(0.975, 16) * error
            mean = differences.mean()
            numbers = (mean, differences.std(ddof=1), error, mean - reach, mean + reach)
            row = [
                item.capitalize(),
                f"{block_result.names[other]} − {block_result.names[0]}",
                "17",
                *map("{:.2f}".format, numbers),
            ]
            assert " ".join(row).replace("-", "−") in visible_text
