"""The R script of the report computes each hypothesis again, from the answers and estimates in the tables."""

import csv
import re
from pathlib import Path

import pytest

from study_app.analysis.data.study_tables import load_study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.report.write_report import report
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.unblinding import unblind
from tests.analysis.report.read_report import run_in_r
from tests.studies import made_up

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]

QUESTIONS = """
format = 2
sequence = ["first", "rest", "second", "rest", "delays"]
study.name = "line"
liquids.honey.drag = { law = "linear", damping_nspm = 8 }
liquids.water.drag = { law = "linear", damping_nspm = 1 }
conditions.honey.liquid = "honey"
conditions.water.liquid = "water"
conditions.prompt.liquid = "water"
conditions.again.liquid = "water"
conditions.late = { liquid = "water", delay_ms = 120 }
tasks.stir.kind = "follow"
scales.seven.labels.en = ["1", "2", "3", "4", "5", "6", "7"]
groups = { old = {}, new = { share = 2 } }

[questionnaires.after]
intro = "How did it feel?"
scale = "seven"
items = [
  { id = "thick", kind = "slider", text = "How thick was it?", short = "Thickness", low = "thin", high = "thick" },
  { id = "smooth", text = "It was smooth.", short = "Smooth" },
]
scores.double = { items = ["thick"], combine = "sum", factor = 2 }

[questionnaires.rest]
intro = "And now?"
items = [{ id = "tired", kind = "slider", text = "How tired are you?", short = "Tired", low = "not", high = "very" }]

[blocks.first]
conditions = ["honey", "water"]
questionnaire = "after"
repetitions = 2
order = "shuffled"

[blocks.second]
conditions = ["honey", "water"]
questionnaire = "after"

[blocks.delays]
conditions = ["prompt", "again", "late"]
replicates = true
questionnaire = "after"

[analysis]
participants = 11
contrasts = [
  { measure = "thick", blocks = ["first"], conditions = ["honey", "water"], expected = "higher" },
  { measure = "smooth", blocks = ["second", "first"], expected = "lower" },
  { measure = "smooth", blocks = ["delays"], groups = ["old", "new"] },
  { measure = "smooth", blocks = ["delays"], conditions = ["late", "again"] },
  { measure = "thick", blocks = ["first"], conditions = ["water", "honey"], groups = ["new", "old"] },
  { measure = "tired", blocks = ["second", "first"], form = "rest" },
  { measure = "double", blocks = ["second"], conditions = ["honey", "water"] },
]
"""
SETTINGS = """
format = 2
study.name = "matching"
liquids.damper.drag = { law = "linear", damping_nspm = 6 }
tasks.stir.kind = "follow"
stimuli.damping = { vary = "damping_nspm", level = "value", standards = [4, 10], levels = [2, 16] }
stimuli.coarse = { vary = "damping_nspm", level = "weber", standards = [8], levels = [0.1, 0.6], spacing = "log" }
methods.set = { kind = "adjustment", repetitions = 4 }
methods.follow = { kind = "updown", trials = 16 }
groups = { old = {}, new = {} }
blocks.both = { stimulus = "damping", design = "adjustment", method = "set" }
blocks.weak = { stimulus = "damping", standards = [4], design = "adjustment", method = "set" }
blocks.left = { stimulus = "coarse", design = "2ifc", method = "follow" }
blocks.right = { stimulus = "coarse", design = "2ifc", method = "follow" }

[analysis]
contrasts = [
  { measure = "pse", blocks = ["both", "weak"], expected = "higher" },
  { measure = "pse", blocks = ["weak"], groups = ["new", "old"] },
  { measure = "threshold", blocks = ["left", "right"] },
]
"""
NUMBERS = ("t", "p", "difference", "ratio", "interval, low", "interval, high", "standardised effect")


@pytest.mark.parametrize(
    ("text", "participants", "computed", "skipped"),
    [
        (QUESTIONS, 11, 6, "hypothesis 7, double: not computed, because scores are computed from several answers"),
        (SETTINGS, 7, 2, "hypothesis 3, threshold: not computed, because thresholds are weighted by their precision"),
    ],
    ids=["questions", "settings"],
)
def test_r_computes_each_hypothesis_from_the_tables(
    tmp_path: Path, text: str, participants: int, computed: int, skipped: str
) -> None:
    file, folder, to = tmp_path / "study.toml", tmp_path / "results", tmp_path / "report"
    file.write_text(text, encoding="utf-8", newline="\n")
    features = {} if text == SETTINGS else made_up(file)
    rehearse_answers(file, participants=participants, seed=4, results=folder, features=features)
    unblind(folder, "AB", "to analyse")
    report(folder, to, failed=pytest.fail)
    run = run_in_r(to)
    assert (run.returncode, run.stderr) == (0, "")
    lines = run.stdout.splitlines()
    assert lines[-1] == "all numbers that R computed agree with the report"
    assert skipped in [line.strip() for line in lines]
    by_hypothesis: dict[int, dict[str, float]] = {}
    for line in lines:
        if match := re.match(r"hypothesis (\d+), \w+: (.+?) +report +(\S+) +R +(\S+)", line):
            by_hypothesis.setdefault(int(match[1]), {})[match[2]] = float(match[4])
    hypotheses = evaluate(load_study(folder), recordings=False).contrasts[:computed]
    assert [*by_hypothesis] == [*range(1, computed + 1)]
    for result, numbers in zip(hypotheses, by_hypothesis.values(), strict=True):
        assert result.interval is not None
        assert result.standardised is not None
        values = (
            result.statistic, result.p, result.effect, result.interval.low, result.interval.high,
            result.standardised.value,
        )  # fmt: skip
        assert list(numbers) == [name for name in NUMBERS if name not in {"difference", "ratio"} - {result.effect_name}]
        assert list(numbers.values()) == pytest.approx(values, rel=1e-5, abs=1e-9)

    (table,) = to.glob("*_description-responses_data.csv" if text == QUESTIONS else "*_description-settings_data.csv")
    with table.open(encoding="utf-8", newline="") as lines_of_table:
        head, *rows = csv.reader(lines_of_table)
    column, block = head.index("value" if text == QUESTIONS else "pse"), head.index("block")
    changed = next(row for row in rows if row[block] in ("first", "weak") and row[column] != "n/a")
    changed[column] = str(float(changed[column]) + 1)
    with table.open("w", encoding="utf-8", newline="") as lines_of_table:
        csv.writer(lines_of_table, lineterminator="\n").writerows([head, *rows])
    run = run_in_r(to)
    assert run.returncode == 1
    assert re.search(r"^hypothesis 1, .*DIFFERS$", run.stdout, re.MULTILINE)
