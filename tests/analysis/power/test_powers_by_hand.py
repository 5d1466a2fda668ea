"""Curves, tables and figures of power from counts of studies that were made up by hand."""

import csv
import io
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from study_app.analysis.data.blocks import Item, Setting
from study_app.analysis.planning.power_curves import Powers, draw_power, interval, power_csv, power_markdown, powers
from study_app.analysis.planning.simulated_studies import EFFECTS, FULL, Plan, PlannedBlock
from study_app.protocol.model import Contrast
from study_app.protocol.participants.raters import CONSISTENT, NOISY, PUBLISHED, TYPICAL
from tests.analysis.made_up import DECIDED

SIZES, STUDIES = (6, 12), 20
PAIRED = Contrast(measure="warm", blocks=("oils",), conditions=("thin", "wax"), bound=1.0)
CROSSED = Contrast(measure="warm", blocks=("oils", "late"))
FIRST = "agreement with “warm” differs between thin and wax in block oils, with an equivalence bound of 1"
SECOND = CROSSED.described()


def planned_block(name: str, kind: Any, settings: tuple[Setting, ...], items: tuple[str, ...]) -> PlannedBlock:
    return PlannedBlock(
        id=name, title=f"Title {name}", kind=kind, settings=settings, labels=tuple("1234567"),
        items=tuple(Item(id=item, text=item, short=item.capitalize()) for item in items), features=(), repetitions=1,
        cannot_judge=None,
        groups=("old", "new") if name == "oils" else (),
    )  # fmt: skip


DELAYS = tuple(
    Setting(code=f"S{place}", condition=f"d{place}", liquid="oil", delay_ms=float(ms))
    for place, ms in enumerate((10, 10, 40, 90))
)
OILS = tuple(Setting(code=name, condition=name, liquid=name, delay_ms=0.0) for name in ("thin", "wax", "tar"))
LATE, THICK = (
    planned_block("late", "delays", DELAYS, ("warm", "different")),
    planned_block("oils", "liquids", OILS, ("warm",)),
)
PLAN = Plan(
    name="kitchen", title="Kitchen", version="2.5", blocks=(THICK, LATE), decided=replace(DECIDED, alpha=0.04),
    kinds={kind: PUBLISHED[kind] for kind in (TYPICAL, CONSISTENT, NOISY)}, participants=6,
    contrasts=(PAIRED, CROSSED),
)  # fmt: skip


def by_effect(*rows: tuple[int, int]) -> np.ndarray:
    """Return the counts of each size, which rise up to the full effect; larger effects are always detected."""
    counts = np.zeros((len(rows), len(EFFECTS)))
    for row, (without, full) in enumerate(rows):
        counts[row] = np.interp(np.arange(len(EFFECTS)), [0, FULL, FULL + 1], [without, full, STUDIES])
    return counts


def counts_of(more: int) -> dict[Any, np.ndarray]:
    """Return the counts of one kind of participants; ``more`` studies detect the trend of the second statement."""
    effects = np.array(EFFECTS)[:, None, None]
    shape_of_late, shape_of_oils = (
        np.array([[0, 0], [0.2, 0.1], [1.0, 0.5], [-2.0, 3.0]]),
        np.array([[0.0], [2.5], [-1.0]]),
    )
    return {
        ("oils", "means"): STUDIES * (4 + effects * shape_of_oils),
        ("oils", "any"): by_effect((1, 9), (2, 13)),
        ("oils", "found"): by_effect((2, 8), (3, 14))[..., None],
        ("late", "means"): STUDIES * (4 + effects * shape_of_late),
        ("late", "all"): by_effect((1, 10), (0, 19)),
        ("late", "found"): np.stack([by_effect((0, 12), (1, 17)), by_effect((1, 4 + more), (2, 6 + more))], axis=2),
        ("late", "lowest"): np.array([[[0, 3, 7, 12], [0, 0, 0, 0]], [[0, 4, 11, 16], [0, 0, 0, 0]]]),
        ("late", "equivalent"): np.array(
            [
                [[[9, 4, 6], [8, 1, 2]], [[7, 3, 0], [6, 5, 7]]],
                [[[19, 14, 16], [18, 11, 12]], [[17, 13, 10], [20, 15, 17]]],
            ]
        ),
        (PAIRED.described(), "contrast"): by_effect((3, 15), (4, 18)),
        (f"{PAIRED.described()}, if there is no difference", "contrast"): by_effect((0, 5), (0, 11)),
        (CROSSED.described(), "contrast"): by_effect((5, 16), (6, 20)),
    }


@pytest.fixture(scope="module")
def power() -> Powers:
    counts = {kind: counts_of(more) for kind, more in ((TYPICAL, 0), (CONSISTENT, 3), (NOISY, -4))}
    return powers(PLAN, SIZES, STUDIES, 40, 7, counts)


def test_each_curve_has_the_shares_of_its_own_test(power: Powers) -> None:
    """The range of the oils is 3.5 points; answers to "warm" fall by 2 points over the delays."""
    curves = [
        (curve.block, curve.question, curve.item, curve.over, curve.setting, curve.power, curve.alarms, curve.effect)
        for curve in power.curves
    ]
    equivalence = "late", "equivalence"
    none = "if there is no difference"
    assert curves == [
        ("oils", "conditions differ", None, "at least one statement", None, (0.45, 0.65), (0.05, 0.1), None),
        ("oils", "conditions differ", "warm", "", None, (0.4, 0.7), (0.1, 0.15), 3.5),
        ("late", "trend", None, "all statements at once", None, (0.5, 0.95), (0.05, 0.0), None),
        ("late", "trend", "warm", "", None, (0.6, 0.85), (0.0, 0.05), 2.0),
        ("late", "trend", "different", "", None, (0.2, 0.3), (0.05, 0.1), 3.0),
        ("late", "lowest delay", "warm", "", "40 ms", (0.35, 0.55), None, None),
        ("late", "lowest delay", "warm", "", "90 ms", (0.6, 0.8), None, None),
        (*equivalence, "warm", "", "40 ms", (0.15, 0.65), (0.2, 0.7), 1.0),
        (*equivalence, "warm", "", "90 ms", (0.0, 0.5), (0.3, 0.8), -2.0),
        (*equivalence, "different", "", "40 ms", (0.25, 0.75), (0.05, 0.55), 0.5),
        (*equivalence, "different", "", "90 ms", (0.35, 0.85), (0.1, 0.6), 3.0),
        (*equivalence, "warm", "", none, (pytest.approx(0.25), pytest.approx(0.75)), None, None),
        (*equivalence, "different", "", none, (pytest.approx(0.075), pytest.approx(0.575)), None, None),
        ("oils", "contrast", None, FIRST, None, (0.75, 0.9), (0.15, 0.2), None),
        ("oils", "contrast", None, f"{FIRST}, {none}", None, (0.25, 0.55), None, None),
        ("oils", "contrast", None, SECOND, None, (0.8, 1.0), None, None),
    ]
    warm, different = power.curves[3:5]
    assert [curve.power for curve in power.curves_by_kind(different)] == [(0.2, 0.3), (0.35, 0.45), (0.0, 0.1)]
    assert (warm.needed_size(SIZES), different.needed_size(SIZES)) == (12, None)
    assert power.curves[-1].needed_size(SIZES) == 6, "a power of exactly 80 % is enough"
    assert not power.complete


def test_the_csv_has_a_row_for_each_test_kind_and_size(power: Powers) -> None:
    """The detectable effect of 12 participants lies where 16 of 20 studies find it: between 3 / 4 and the full one."""
    rows = list(csv.DictReader(io.StringIO(power_csv(power).decode())))
    assert len(rows) == len(power.curves) * 3 * 2
    keys = "block", "question", "item", "people", "participants"
    (row,) = (row for row in rows if [row[key] for key in keys] == ["late", "trend", "warm", TYPICAL, "12"])
    low, high = interval(0.85, STUDIES)
    share = (16 - (17 - 16 / FULL)) / (16 / FULL)
    assert float(row.pop("detectable_points")) == pytest.approx(2 * (0.75 + 0.25 * share), abs=6e-4)
    assert row == {
        "study": "kitchen", "simulated": "true", "block": "late", "question": "trend", "item": "warm", "over": "n/a",
        "setting": "n/a", "people": TYPICAL, "participants": "12", "studies": "20", "power": "0.85",
        "power_low": f"{low:.4g}", "power_high": f"{high:.4g}", "without_effect": "0.05", "effect_points": "2.0",
    }  # fmt: skip


def test_the_tables_name_each_block_test_and_range_over_the_kinds_of_participants(power: Powers) -> None:
    lines = power_markdown(power).splitlines()
    assert lines[0] == "# Power for Kitchen (kitchen 2.5)"
    text = "\n".join(lines)
    assert "(seed 7, liquid-study" in text
    assert "Tests use α = 0.04; p values" in text
    assert "**Preliminary: 20 of 40 studies were simulated.**" in lines
    assert "The model does not assume any effects for warm, so any effects detected for this statement are" in text
    groups = (
        "Title oils: n counts only the participants in old and new, because other groups do not complete this block."
    )
    assert groups in lines
    low, high = interval(0.8, STUDIES)
    assert f"A power of 80 % has an uncertainty of ±{50 * (high - low):.1f} percentage points." in text
    differ, trend, lowest, equal, hypotheses = (
        lines.index(f"## Title {head}")
        for head in (
            "oils: do the conditions differ?", "late: do answers change with the delay?",
            "late: is a trend found up to this delay or a shorter one?",
            "late: can any delay be shown to be equivalent to the shortest one?",
            "oils: can the study support the hypothesis?",
        )
    )  # fmt: skip
    assert differ < hypotheses < trend < lowest < equal
    head = "| statement | n = 6 (planned) | n = 12 | n for 80 % power |"
    assert lines[differ + 4 : differ + 8] == [
        head, "|---|---:|---:|---:|", "| *at least one statement* | 45 % | 65 % | > 12 |",
        "| Warm | 40 % | 70 % | > 12 |",
    ]  # fmt: skip
    assert lines[trend + 4 : trend + 9] == [
        head, "|---|---:|---:|---:|", "| *all statements at once* | 50 % | 95 % | 12 |",
        "| Warm | 60 % | 85 % | 12 |", "| Different | 20 % (0–35 %) | 30 % (10–45 %) | > 12 |",
    ]  # fmt: skip
    assert "| Warm, 90 ms | 60 % | 80 % | 12 |" in lines[lowest:equal]
    assert "| Warm, 40 ms | 15 % | 65 % | > 12 |" in lines[equal:]
    assert "two one-sided t tests (bounds ±1 point)" in lines[equal + 2]
    assert f"| *{SECOND}* | 80 % | 100 % | 6 |" in lines[hypotheses:trend]
    assert "## Title late: can the study support the hypothesis?" not in lines
    summary = lines.index("## Power with the planned 6 participants")
    assert lines[summary + 2 : summary + 6] == [
        f"- {title}: {consistent} of studies {finding} if participants are consistent, {typical} if they are typical, "
        f"and {noisy} if they are noisy."
        for title, finding, (consistent, typical, noisy) in (
            ("Different (trend over delay in Title late)", "detect the effect", ("35 %", "20 %", "0 %")),
            (FIRST, "detect the effect", ("75 %",) * 3),
            (f"{FIRST}, if there is no difference", "show equivalence", ("25 %",) * 3),
            (SECOND, "detect the effect", ("80 %",) * 3),
        )
    ]


@pytest.mark.slow
def test_the_figure_has_a_plot_for_each_statement_and_the_test_over_all(power: Powers) -> None:
    figure = draw_power(power, LATE)
    title = figure.get_suptitle()
    assert title.startswith(
        "Title late: proportion of 20 studies with SIMULATED participants, by number of participants"
    )
    assert "α = 0.04; line: typical participants; band" in title
    assert [(axes.get_title(loc="left"), axes.get_ylabel()) for axes in figure.axes] == [
        ("Warm", "trend over delay"), ("Different", ""), ("All statements at\nonce", ""),
        ("Warm", "trend up to this delay"), ("Warm", "equivalent to the control"), ("Different", ""),
    ]  # fmt: skip
    lines = [[np.asarray(line.get_ydata()).tolist() for line in axes.lines] for axes in figure.axes]
    assert lines == [
        [[0.6, 0.85], [0.0, 0.05]], [[0.2, 0.3], [0.05, 0.1]], [[0.5, 0.95], [0.05, 0.0]],
        [[0.35, 0.55], [0.6, 0.8]], [[0.15, 0.65], [0.0, 0.5]], [[0.25, 0.75], [0.35, 0.85]],
    ]  # fmt: skip
    assert {tuple(np.asarray(line.get_xdata())) for axes in figure.axes for line in axes.lines} == {SIZES}
    band = figure.axes[1].collections[0].get_paths()[0].vertices
    assert sorted({(x, y) for x, y in band.tolist()}) == [(6.0, 0.0), (6.0, 0.35), (12.0, 0.1), (12.0, 0.45)]
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["40 ms", "90 ms"]
