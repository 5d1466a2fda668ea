"""Which tests apply to which block, what is corrected with what, and what may be said."""

import json
import random
from dataclasses import astuple, fields, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom

from study_app.analysis import results
from study_app.analysis.data.blocks import Block, Decided, Item, Setting
from study_app.analysis.data.study_tables import load_study
from study_app.analysis.evaluate import _delivery_check, evaluate
from study_app.analysis.findings.delays import ContrastsWithControl
from study_app.analysis.findings.finding import MANY, answers_from_tables, corrected_tests
from study_app.analysis.findings.recognition import LiquidRecognition
from study_app.analysis.findings.statement_tests import DelayTrend, Pairs, SettingsDiffer, pairs_of
from study_app.analysis.report.write_report import as_json_types
from study_app.analysis.results import BlockResult, Delivered, Results
from study_app.analysis.statistics.outcome import DRAWS, false_discovery, holm
from study_app.analysis.statistics.rank_tests import friedman, signed_rank_test
from study_app.protocol.load import parse
from study_app.protocol.source.files import source_bytes
from tests.analysis.conftest import Answer, make_results, twelve
from tests.analysis.conftest import Results as Folder
from tests.analysis.made_up import delays as of_delays
from tests.analysis.made_up import everybody, study

pytestmark = pytest.mark.slow

DECIDED = Decided(
    made=True,
    changed=False,
    alpha=0.05,
    equivalence_bound=1.0,
    primary=("a", "b"),
    names=(),
    rising=(),
    falling=(),
    noticed=None,
)


NOBODY = answers_from_tables(
    Block(id="b", title="Block", kind="liquids", settings=(), items=(), labels=(), cannot_judge=None), DECIDED, (), {}
)


def evaluated(folder: Folder) -> Results:
    return evaluate(load_study(folder.folder))


def blocks(folder: Folder) -> tuple[BlockResult, BlockResult]:
    liquids, delays = evaluated(folder).blocks
    return liquids, delays


def open_study(folder: Folder, people: int) -> Folder:
    twelve(folder, people=people)
    folder.open()
    return folder


def without(table: str, folder: Path) -> Folder:
    """Return an empty study of the thesis whose protocol lacks lines of ``[analysis]``."""
    text = source_bytes("rek2024").decode()
    head, tail = text.split("\n[analysis]\n")
    analysis_table = (
        ""
        if table == "all"
        else "\n[analysis]\n" + "".join(f"{line}\n" for line in tail.splitlines() if not line.startswith(table))
    )
    if table in ("all", "names"):
        head = "\n".join(line for line in head.splitlines() if not line.startswith("label = "))
    return make_results(folder, parse((head + analysis_table).encode(), "rek2024.toml"))


def test_primary_statements_are_a_holm_family_and_the_others_exploratory() -> None:
    draw = random.Random(1)  # noqa: S311 - reproducible
    outcomes = {
        item: friedman([[draw.gauss(shift * place, 1) for place in range(3)] for _ in range(8)])
        for item, shift in zip("abcd", (2.0, 0.1, 1.5, 0.0), strict=True)
    }
    tested = {row.item: row for row in corrected_tests(outcomes, NOBODY, "family")}
    assert list(tested) == list("abcd")
    ps = {item: outcome.p for item, outcome in outcomes.items()}
    assert (tested["a"].p_adjusted, tested["b"].p_adjusted) == holm([ps["a"], ps["b"]])
    assert (tested["c"].p_adjusted, tested["d"].p_adjusted) == false_discovery([ps["c"], ps["d"]])
    assert [tested[item].members for item in "abcd"] == [2, 2, 2, 2]
    assert [tested[item].verdict for item in "abcd"] == ["shown", "not shown", "suggested", "not shown"]
    assert [tested[item].primary for item in "abcd"] == [True, True, False, False]


def test_a_test_that_could_never_be_significant_is_out_of_reach() -> None:
    three = friedman([[1, 2, 3], [1, 2, 3], [3, 1, 2]])
    assert three.smallest_p == pytest.approx(1 / 36)
    (row, _) = corrected_tests({"a": three, "b": three}, NOBODY, "family")
    assert (row.verdict, row.p_adjusted) == ("out of reach", 1.0)
    (alone,) = corrected_tests({"a": three}, NOBODY, "family")
    assert alone.verdict == "not shown"  # one test of its own could have come to .028
    flat = friedman([[4, 4, 4]] * 5)
    (none,) = corrected_tests({"a": flat}, NOBODY, "family")
    assert (none.verdict, none.p_adjusted) == ("not tested", None)


def test_five_participants_are_too_few_for_pairs_and_the_reason_is_stated(rek: Folder) -> None:
    liquids, delays = blocks(open_study(rek, 5))
    assert Pairs.value_in(liquids) == ()
    assert [absence.what for absence in liquids.absent] == [
        "pairwise comparison of conditions",
        "cumulative mixed model",
    ]
    why = "5 participants cannot show a difference between two conditions: the smallest attainable p is .062, and .188"
    assert liquids.absent[0].why.startswith(f"{why} after Holm's correction for 3 pairs, which is above 0.05")
    assert [absence.what for absence in delays.absent] == [
        "shortest delay with a trend",
        "detection threshold",
        "cumulative mixed model",
    ]


def test_without_a_decided_analysis_every_test_is_exploratory(tmp_path: Path) -> None:
    results = evaluated(open_study(without("all", tmp_path / "rek2024"), 8))
    liquids, delays = results.blocks
    assert not results.decided.made
    assert {test.primary for test in SettingsDiffer.value_in(liquids)} == {False}
    assert {test.correction for test in SettingsDiffer.value_in(liquids)} == {"Benjamini-Hochberg"}
    assert "shown" not in {test.verdict for test in SettingsDiffer.value_in(liquids)}
    why = {absence.what: absence.why for absence in (*liquids.absent, *delays.absent)}
    assert "be influenced by the answers" in why["equivalence test"]
    assert "recognition test" not in why, "the study does not ask participants to recognise liquids"
    assert {test.outcome.method.split(", ")[1] for test in DelayTrend.value_in(delays)} == {"two-sided"}
    assert "does not specify a detection question" in why["detection threshold"]


def test_an_undecided_equivalence_bound_is_not_invented(tmp_path: Path) -> None:
    _, delays = blocks(open_study(without("equivalence_bound", tmp_path / "rek2024"), 8))
    assert ContrastsWithControl.entries(delays) == {"against": (), "equivalent_up_to": {}}
    assert len(DelayTrend.value_in(delays)) == 5


@pytest.mark.parametrize("level", [1, 4, 7])
def test_identical_answers_are_not_tested(rek: Folder, level: int) -> None:
    for number in range(1, 18):
        rek.add(f"P{number:03d}", lambda _condition, _item: level)
    rek.open()
    results = evaluated(rek)
    json.dumps(as_json_types(results), allow_nan=False)
    liquids, delays = results.blocks
    assert {test.verdict for test in (*SettingsDiffer.value_in(liquids), *DelayTrend.value_in(delays))} == {
        "not tested"
    }
    assert {test.found.verdict for test in ContrastsWithControl.value_in(delays)} == {
        "equivalent"
    }  # none of seventeen moved
    assert LiquidRecognition.value_in(liquids) is not None
    assert LiquidRecognition.value_in(liquids).found.undecided == 51


def test_trials_judged_and_valid_and_errors_of_the_delay_are_counted_by_setting_or_over_all_while_sealed() -> None:
    """The last trial of D1 is excluded, another one was not judged and a third is not valid."""
    case_study = study(of_delays([40, 10.5]), list(everybody(of_delays([40, 10.5]), 6, lambda *_: 4)))
    trials = case_study.trials.sort_values("code", kind="stable").assign(
        valid=pd.array([True, None, False, True, True, True, None, True, False, None, None, True], "boolean"),
        delay_error_mean_ms=[1.0, -4.0, None, 2.0, 3.0, 90.0, None, 0.5, 0.25, 6.0, None, 1.25],
        counted=np.arange(12) != 5,
    )

    def delivered(settings: tuple[Setting, ...]) -> list[tuple[object, ...]]:
        unblinded = replace(case_study, trials=trials, blocks=(replace(case_study.blocks[0], settings=settings),))
        return [astuple(row) for row in _delivery_check(unblinded)]

    names = "block code delay_ms trials measured judged valid error_mean_ms error_worst_ms achieved_ms"
    assert [field.name for field in fields(Delivered)] == names.split()
    assert delivered(case_study.blocks[0].settings) == [
        ("b", "D2", 10.5, 6, 4, 3, 2, 2.0, 6.0, 12.5), ("b", "D1", 40.0, 5, 4, 4, 3, 0.5, -4.0, 40.5),
    ]  # fmt: skip
    sealed = Setting(code="D1"), Setting(code="D2")
    assert delivered(sealed) == [("b", None, None, 11, 8, 7, 5, 1.25, 6.0, None)]


def test_missing_answers_exclude_the_participant_and_never_count_as_neutral(rek: Folder) -> None:
    twelve(rek, people=8)
    before = {test.item: test.outcome for test in _omnibus(rek)}

    def missing(condition: str, item: str) -> Answer:
        return None if (condition, item) == ("honey", "immersive") else 4

    rek.add("P100", missing)
    rek.open()
    liquids, _ = blocks(rek)
    immersive = next(test for test in SettingsDiffer.value_in(liquids) if test.item == "immersive")
    assert (immersive.outcome.n, immersive.outcome.dropped) == (8, 1)
    assert immersive.outcome.p == pytest.approx(before["immersive"].p)
    assert next(row for row in liquids.measures if row["item"] == "immersive" and row["missing"])["n"] == 8


def _omnibus(folder: Folder) -> tuple:  # type: ignore[type-arg]
    return SettingsDiffer.value_in(evaluated(folder).blocks[0])


@pytest.mark.parametrize("n", [12, 24])
def test_liquids_that_do_not_differ_are_rarely_distinguished(n: int) -> None:
    """Honey differs in all nine statements; water and light oil are answered alike."""
    rng = np.random.default_rng(n)
    settings = tuple(
        Setting(code=code, condition=code, liquid=code, delay_ms=0.0) for code in ("water", "honey", "oil")
    )
    items = tuple(Item(id=f"s{number}", text="?", short="?") for number in range(9))
    block = Block(
        id="liquids",
        title="Liquids",
        kind="liquids",
        settings=settings,
        items=items,
        labels=tuple("1234567"),
        cannot_judge=None,
    )
    decided = replace(DECIDED, primary=())
    wrong = right = 0
    opened_ = signed_rank_test([1.0, 2.0], [2.0, 1.0])
    omnibus = tuple(
        results.Tested(
            item=item.id,
            outcome=opened_,
            family="f",
            members=9,
            correction="Holm",
            p_adjusted=0.001,
            primary=True,
            verdict="shown",
        )
        for item in items
    )
    for _ in range(100):
        latent = 3.5 + np.array([[0.0], [2.0], [0.0]]) + rng.normal(0, 1, (9, n, 3, 1))
        values = {item.id: np.clip(np.rint(rows), 1, 7) for item, rows in zip(items, latent, strict=True)}
        people = tuple(f"P{number:03d}" for number in range(n))
        pairs, _ = pairs_of(answers_from_tables(block, decided, people, values), omnibus)
        right += sum(pair.tested.verdict == "shown" for pair in pairs if "honey" in (pair.first, pair.second))
        wrong += any(pair.tested.verdict == "shown" for pair in pairs if "honey" not in (pair.first, pair.second))
    assert right >= 100 * 9
    assert wrong <= binom.ppf(0.999, 100, 0.05)


@pytest.mark.parametrize(("statements", "alpha"), [(5, 0.05), (40, 0.05), (9, 0.001), (100, 0.01)])
@pytest.mark.parametrize("people", [20, MANY + 1])
def test_the_number_of_draws_does_not_change_the_verdicts(statements: int, alpha: float, people: int) -> None:
    items = tuple(
        Item(id=f"s{number}", text=f"Statement {number}.", short=f"S{number}") for number in range(statements)
    )
    settings = tuple(Setting(code=f"L{number}") for number in range(1, 4))
    block = Block(
        id="liquids",
        title="Liquids",
        kind="liquids",
        settings=settings,
        items=items,
        labels=tuple("1234567"),
        cannot_judge=None,
    )
    rng = np.random.default_rng(3)
    values = {item.id: rng.integers(1, 8, (people, 3, 1)).astype(float) for item in items}
    names = tuple(f"P{number:04d}" for number in range(people))
    results_of_answers = answers_from_tables(block, replace(DECIDED, alpha=alpha), names, values)
    assert statements / (1 + results_of_answers.draws) <= alpha / 20
    assert 1 / (1 + results_of_answers.draws_over_all) <= alpha / 20
    assert results_of_answers.draws >= DRAWS
