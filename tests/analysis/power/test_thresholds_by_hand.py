"""The tables of precision and the sentences of a preregistration, for values made up by hand."""

import csv
import io
import math

import numpy as np
import pytest
from scipy.special import stdtrit

from study_app.analysis.planning import preregistration as documents
from study_app.analysis.planning.power_curves import interval
from study_app.analysis.planning.threshold_studies import PrecisionResult, Precisions, threshold_csv, threshold_markdown
from study_app.analysis.statistics.mean_tests import equivalence_power
from study_app.protocol.load import parse
from study_app.protocol.model import Protocol
from tests.analysis.test_contrasts import DELAYED
from tests.protocol.groups.grouped import grouped

TEXT = (
    DELAYED.partition("[analysis]")[0].replace(
        'study.name = "delayed"', 'study.name = "two"\nstudy.title.en = "Two parts"'
    )
    + """
[analysis]
participants = 12
precision = 0.3
contrasts = [
    { measure = "threshold", blocks = ["late", "prompt"], expected = "higher", bound = 1.25 },
    { measure = "threshold", blocks = ["prompt", "late"] },
]
"""
)


def two(*edits: tuple[str, str]) -> Protocol:
    text = TEXT
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    return parse(text.encode(), "two.toml")


def result_of(error: float, *halves: tuple[float, float]) -> PrecisionResult:
    """Return studies whose errors are ± ``error`` and whose half-widths are those of two sizes."""
    return PrecisionResult([np.array([[error], [-error]])] * len(halves), [np.array(half) for half in halves])


FOUND = {
    ("late", 20): result_of(0.2, (0.31, 0.25), (0.29, 0.2), (0.9, 0.28), (0.4, 0.31)),
    ("late", 40): result_of(0.1, (math.nan, 0.2), (math.nan, 0.21), (math.nan, math.inf), (math.nan, 0.22)),
    ("prompt", 20): result_of(math.inf, (0.5, 0.6), (0.5, 0.6), (0.5, 0.6), (0.5, 0.6)),
}
PRECISIONS = Precisions(protocol=two(), sizes=(5, 12), studies=4, asked=9, seed=3, found=FOUND)


def test_the_csv_has_a_row_for_each_block_trials_and_size() -> None:
    """The SD of ± 0.2 is 0.2 √2; three of four half-widths of twelve participants are at most 30 %."""
    rows = list(csv.DictReader(io.StringIO(threshold_csv(PRECISIONS).decode())))
    low, high = interval(0.75, 4)
    assert rows[1] == {
        "study": "two", "simulated": "true", "block": "late", "trials": "20", "participants": "12", "studies": "4",
        "spread": f"{0.2 * math.sqrt(2):.4f}", "half_interval": "0.265", "precision": "0.3", "within": "0.75",
        "within_low": f"{low:.4f}", "within_high": f"{high:.4f}",
    }  # fmt: skip
    names = "block", "trials", "participants", "spread", "half_interval", "within"
    assert [[row[name] for name in names] for row in rows] == [
        ["late", "20", "5", "0.2828", "0.355", "0.25"],
        ["late", "20", "12", "0.2828", "0.265", "0.75"],
        ["late", "40", "5", "0.1414", "n/a", "n/a"],
        ["late", "40", "12", "0.1414", "0.215", "0.75"],
        ["prompt", "20", "5", "n/a", "0.5", "0.0"],
        ["prompt", "20", "12", "n/a", "0.6", "0.0"],
    ]
    protocol = two(("precision = 0.3\n", ""))
    unplanned = Precisions(protocol=protocol, sizes=(5, 12), studies=4, asked=4, seed=3, found=FOUND)
    first, *_ = csv.DictReader(io.StringIO(threshold_csv(unplanned).decode()))
    assert [first[name] for name in ("precision", "within", "within_low")] == ["n/a"] * 3


def test_the_tables_of_precision_have_a_row_for_each_size_and_the_contrasts_of_both_blocks() -> None:
    lines = threshold_markdown(PRECISIONS).splitlines()
    assert lines[0] == "# Expected precision for Two parts (two 1)"
    assert lines[2].startswith("**SIMULATED.** Each row summarises 4 studies (seed 3, liquid-study ")
    assert "**Preliminary: 4 of 9 studies were simulated.**" in lines
    late, prompt = lines.index("## Late (block late)"), lines.index("## Prompt (block prompt)")
    assert lines[late + 4 : late + 10] == [
        "| trials per standard | participants | SD for one participant | half-width of the group's 95 % interval | "
        "studies within ±30 % |",
        "|---:|---:|---:|---:|---:|",
        "| 20 | 5 | 28 % | ±36 % | 25 % |",
        "| 20 | 12 (planned) | 28 % | ±26 % | 75 % |",
        "| 40 | 5 | 14 % | – | – |",
        "| 40 | 12 (planned) | 14 % | ±22 % | 75 % |",
    ]
    assert lines[prompt + 6] == "| 20 | 5 | – | ±50 % | 0 % |"


@pytest.mark.slow
def test_a_contrast_has_the_errors_of_both_blocks_and_the_alpha_of_its_family() -> None:
    """Student's t(11) at 97.5 % is 2.201, and one of two hypotheses has a bound."""
    results = {("late", 20): result_of(0.2, (0.3, 0.3)), ("prompt", 20): result_of(0.1, (0.3, 0.3))}
    results |= {("late", 40): result_of(0.05, (0.3, 0.3))}  # of one block only
    precisions = Precisions(protocol=two(), sizes=(12, 40), studies=1, asked=1, seed=1, found=results)
    lines = threshold_markdown(precisions).splitlines()
    spread = math.hypot(math.log(1.2), 0.2 * math.sqrt(2), 0.1 * math.sqrt(2))
    half = spread * stdtrit(11, 0.975) / math.sqrt(12)
    rows = [line for line in lines if line.startswith("| 20 | 12 (planned) | ×/÷")]
    for row in rows:
        assert row.startswith(f"| 20 | 12 (planned) | ×/÷ {math.exp(spread):.2f} | ×/÷ {math.exp(half):.2f} | ×")
    assert [row.count("|") for row in rows] == [7, 6], "only the first hypothesis has a bound"
    equal = equivalence_power(40, alpha=0.05, bound=math.log(1.25) / spread)
    ends = [line.rpartition(" | ")[2] for line in lines if line.startswith("| 20 | 40 | ×/÷")]
    assert ends[0] == f"{100 * equal:.0f} % |"
    first, second = (line for line in lines if "The “smallest difference” is the difference that 80 %" in line)
    assert "(one-sided, α = 0.025 (0.05 divided by 2 hypotheses))" in first
    assert "participants, at α = 0.05." in first
    assert "(two-sided, α = 0.025 (0.05 divided by 2 hypotheses))" in second
    assert "## Contrast: the threshold is higher in Late than in Prompt, with an equivalence bound of 1.25" in lines
    assert not [line for line in lines if line.startswith("| 40 | 12 (planned) | ×/÷")]


def test_a_preregistration_states_each_hypothesis_with_its_test_and_bound() -> None:
    first, second, inclusion, *questions = documents.hypotheses(two(), "en")
    assert first.startswith(
        "Hypothesis: the threshold is higher in “Late” (late_one) than in “Prompt” (prompt_one), with an equivalence "
        "bound of 1.25. We test it with a one-sided paired t test on log-transformed values, using one value per "
        "participant. Participants are weighted as in the group mean."
    )
    assert " We test equivalence with two one-sided t tests and a bootstrap. This requires at least " in first
    assert "with a two-sided paired t test" in second
    assert "equivalence" not in second
    assert inclusion.startswith("Participants are included if both of their values are available, even if a threshold")
    assert [line.partition(":")[0] for line in questions] == ["Block “Prompt”", "Block “Late”"]


def test_a_preregistration_states_the_looks_and_the_goal_of_precision() -> None:
    def lines(*edits: tuple[str, str]) -> str:
        protocol = two(*edits)
        return next(documents._participant_lines(protocol, documents.commitment(protocol, "0" * 64), None))

    goal = " The goal is a 95 % interval for the group mean no wider than ±30 %."
    assert lines() == (
        "We plan to include 12 participants. The study ends when this number of participants have completed a valid "
        f"session; only then are the data unblinded and tested.{goal}"
    )
    looks = lines(("precision = 0.3", 'looks = [6, 12]\nspending = "pocock"'))
    assert looks.startswith(
        "We plan to include 12 participants. The data are unblinded and all tests are run when 6 and 12 participants "
        "have completed a valid session; adjusted p values of up to 0.031 and 0.0"
    )
    assert "(Pocock alpha spending, Lan & DeMets 1983)" in looks
    assert lines(("participants = 12\nprecision = 0.3\n", "")) == (
        "The number of participants has not been decided, and there is no stopping rule."
    )


@pytest.mark.parametrize(
    ("assignment", "sentence"),
    [
        ("randomised", "Participants are randomised in permuted blocks to the groups first_thin and first_thick, with"),
        ("pre-existing", "Participants are assigned to the groups first_thin and first_thick by an existing attribute"),
    ],
)
def test_a_preregistration_states_how_groups_are_formed_and_in_which_order_they_do_the_blocks(
    assignment: str, sentence: str
) -> None:
    head = 'study.name = "grouped"\n'
    protocol = grouped((head, f'{head}study.group_assignment = "{assignment}"\n'))
    lines = list(documents._design_lines(protocol))
    assert lines[1].startswith(sentence)
    assert "1:1" in lines[1]
    assert [line for line in lines if line.startswith("The order of blocks")] == [
        "The order of blocks in group first_thin is fixed: “Thin” and “Thick”.",
        "The order of blocks in group first_thick is fixed: “Thick” and “Thin”.",
    ]
    assert "Block “Thin” compares water and honey. The trial order is drawn for each session." in lines


def test_a_preregistration_states_one_order_of_blocks_if_all_groups_have_it() -> None:
    groups = "".join(
        f'\n[groups.{name}]\nsequence = ["hello", "thin", "thick", "end"]\n' for name in ("early", "later")
    )
    lines = list(documents._design_lines(grouped(groups=groups)))
    assert "The order of blocks is fixed: the same order for all participants." in lines
