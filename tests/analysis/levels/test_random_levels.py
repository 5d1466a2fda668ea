"""Everything said and drawn of blocks of levels of which any number is missing, compared with reviewed files."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from study_app import figure_style
from study_app.analysis.data.blocks import LevelBlock, OwnDynamics
from study_app.analysis.figures.level_figures import level_figure_tasks
from study_app.analysis.figures.summary_figures import estimates_of
from study_app.analysis.levels.answers import Answers, LevelAnswers, SettingEstimate
from study_app.analysis.levels.evaluate import level_findings, level_limits, level_methods, level_section
from study_app.analysis.levels.exponents import ExponentEstimate
from study_app.analysis.levels.sensitivities import SensitivityEstimate
from study_app.analysis.levels.statistic import LevelStatistic, statistics
from study_app.analysis.levels.thresholds import ThresholdEstimate, Thresholds
from study_app.analysis.page_layout import draw_figures
from study_app.analysis.report import first_page
from study_app.analysis.results import Failures, GroupAnswers, LevelsResult
from study_app.protocol.model import Published
from study_app.protocol.trials.designs import Rated, default_design
from study_app.protocol.trials.methods import Constant, QuestPlus, UpDown
from study_app.protocol.trials.stimuli import Stimulus
from tests.analysis.made_up import delays, everybody, study
from tests.analysis.outputs import GOLDEN
from tests.golden import CHANGING, compare, each_once
from tests.golden_figures import figure_words, stub_png
from tests.golden_values import page_lines

VARIED = {
    "damping_nspm": ("damping", "N·s/m", (0.02, 0.6), 8.0),
    "delay_ms": ("delay", "ms", (10.0, 160.0), 50.0),
    "viscosity_pa_s": ("viscosity", "Pa·s", (0.1, 3.0), 2.0),
}
DESIGNS = {
    "share": ("2ifc", "3ifc", "yesno", "samedifferent", "abx", "oddity"),
    "mean": ("rating",), "geometric mean": ("estimation",), "settings": ("adjustment",),
}  # fmt: skip


def random_block(number: int) -> tuple[LevelBlock, LevelsResult]:
    """Return a random block and its results; each optional number is missing in a quarter of the cases."""
    rng = np.random.default_rng(number)

    def some(value: Any, share: float = 0.75) -> Any:
        return value if rng.random() < share else None

    def around(value: float) -> float:
        return float(value * np.exp(rng.normal(0, 0.4)))

    summary = ("share", "share", "settings", "geometric mean", "mean", "share")[number % 6]
    design = str(rng.choice(DESIGNS[summary]))
    vary = "damping_nspm" if number % 4 == 0 else str(rng.choice(list(VARIED)))
    quantity, unit, ends, base = VARIED[vary]
    kind = "weber" if number % 4 == 0 else str(rng.choice(["weber", "difference", "value"]))
    people = [
        f"P{person_number:03d}"
        for person_number in range(1, int(rng.choice([1, 2, 2, 3] if number < 18 else [2, 5, 15])) + 1)
    ]
    standards = [None] if rng.random() < 0.2 else [base, 2 * base, 0.0][: int(rng.integers(2, 4))]
    levels = np.geomspace(*ends, int(rng.integers(1, 5))).round(3).tolist()
    catches, percent = bool(rng.random() < 0.3), some(75.0, 0.5)
    share = summary == "share"

    def answered(person: str | None, standard: float | None, level: float, catch: bool = False) -> LevelAnswers:
        n, value = int(rng.integers(1, 30)), float(rng.random()) if share else around(5)
        low, high = some((max(0.0, value - 0.2), min(1.0, value + 0.2) if share else value + 1), 0.8) or (None, None)
        count = round(value * n) if share else None
        return LevelAnswers(
            participant=person,
            standard=standard,
            level=level,
            comparison=level,
            n=n,
            participants=len(people) if person is None else 1,
            count=count,
            value=value,
            low=low,
            high=high,
            catch=catch,
        )

    def threshold(person: str | None, standard: float | None) -> ThresholdEstimate:
        value = around(ends[1] / 3)
        own: dict[str, Any] = {}
        if percent:
            own = {"compared": some(value * 1.2), "compared_low": some(value), "compared_high": value * 1.6}
        if person is not None:
            own |= {
                "width": some(around(1.0)), "lapse": some(0.02), "guess": some(0.5), "flat_width": some(around(value)),
                "beyond": rng.choice([None, None, "above", "below"]), "variance": 0.01,
                "fit_p": some(float(rng.random() ** 2)), "drift": some(float(rng.normal(0, 0.2))),
                "reversal_mean": some(around(value)), "target_percent": 70.7,
            }  # fmt: skip
        low, high = some((value * 0.7, value * 1.5)) or (None, None)
        return ThresholdEstimate(
            participant=person,
            standard=standard,
            n=int(rng.integers(2, 120)),
            threshold=value,
            low=low,
            high=high,
            **own,
        )

    def set_by(person: str | None, standard: float | None) -> SettingEstimate:
        n, value = int(rng.integers(1, 6)), around(ends[0] * 5)
        ends_ = (value * 0.8, value * 1.3)
        levels_ = tuple(around(value) for _ in range(n)) if person else ()
        high = tuple(bool(is_above) for is_above in rng.integers(0, 2, n)) if person else ()
        error = None if standard is None else float(rng.normal(0, 0.1))
        low, high_end = some(ends_) or (None, None)
        return SettingEstimate(
            participant=person,
            standard=standard,
            n=n,
            pse=value,
            low=low,
            high=high_end,
            jnd=some(around(0.1)),
            constant_error=error,
            hysteresis=some(float(rng.normal(0, 0.1))),
            levels=levels_,
            started_high=high,
        )

    def sensed(person: str | None, standard: float | None) -> SensitivityEstimate:
        d, n = some(around(1.3)), len(people) if person is None else 20
        shares = {"first": float(rng.random()), "second": float(rng.random())}
        low, high = (some(d - 0.5), d + 0.5) if d else (None, None)
        return SensitivityEstimate(
            participant=person,
            n=n,
            shares=shares,
            standard=standard,
            comparison=some("oil", 0.2),
            level=some(levels[0], 0.3),
            d_prime=d,
            low=low,
            high=high,
            criterion=some(float(rng.normal())),
            model=some("differencing"),
            other=some(around(1.0)),
        )

    def run(standard: float | None) -> dict[str, Any]:
        reasons = {"pace_error_percent": 2, "slip": 1} if rng.random() < 0.5 else {}
        numbers = int(rng.integers(1, 99)), int(rng.integers(0, 9)), reasons, int(rng.integers(0, 3))
        names = ("standard", "trials", "repeated", "reasons", "measured", "error_mean", "error_largest", "pace_mps")
        names += ("apparent_mass_kg",)
        values = standard, *numbers, some(-0.01), some(0.03), some(0.1), some(0.02)
        return dict(zip(names, values, strict=True))

    def exponent(person: str | None) -> ExponentEstimate:
        low, high = some((0.4, 1.2)) or (None, None)
        return ExponentEstimate(participant=person, n=int(rng.integers(2, 6)), exponent=around(0.8), low=low, high=high)

    whom = [None, *people]
    revealed = rng.random() < 0.9
    level_result = LevelsResult(
        block="b",
        title="Block",
        design=design,
        revealed=revealed,
        times=tuple(
            GroupAnswers(
                f"V{interval_number}",
                f"standard {interval_number}",
                {"n": interval_number, "median": some(1.5), "q1": some(1.0), "q3": 2.0},
            )
            for interval_number in range(2)
        ),
        summary=summary,
        counts="correct" if design != "yesno" else "yes",
    )
    if not revealed:
        return _block(design, vary, ends, standards, number), level_result
    estimated = share and rng.random() < 0.8
    published = Published.model_construct(
        block="b",
        measure="exponent" if summary == "geometric mean" else "weber",
        value=0.2,
        standard=some(base),
        low=some(0.1),
        high=0.3,
        percent=percent,
        n=some(10),
        source=some("Jones 1997") or "",
    )
    where = [(person, standard) for person in whom for standard in standards]
    more: dict[str, Any] = {
        "vary": vary, "quantity": quantity, "unit": unit, "level_kind": kind, "spacing": rng.choice(["log", "linear"]),
        "guess_rate": some(0.5) if share else None, "bounds": (1.0, 7.0) if summary == "mean" else None,
        "own_units": summary == "geometric mean" and bool(rng.random() < 0.5),
    }  # fmt: skip
    rows: dict[str, Any] = {
        "thresholds": tuple(threshold(*whose) for whose in where) if estimated else (),
        "exponents": tuple(map(exponent, whom)) if estimated or summary == "geometric mean" else (),
        "sensitivities": tuple(sensed(*whose) for whose in where) if share and rng.random() < 0.7 else (),
        "withheld": tuple(
            {"standard": standard, "low": level, "high": level, "n": 4, "mean_percent": float(most) / 3,
             "most_percent": float(most)}
            for standard in standards for level, most in zip(levels, rng.choice([0, 2, 9.0], len(levels)), strict=True)
        ) if vary == "delay_ms" else (),
        "conduct": tuple(map(run, standards)) if rng.random() < 0.8 else (),
        "catches": tuple(
            {"participant": person, "session": 1, "n": 8, "wrong": int(rng.integers(0, 9)), "most": 0.5}
            for person in people
        ) if catches else (),
    }  # fmt: skip
    more |= {
        "family": some(str(rng.choice(["weibull", "normal", "logistic"])), 0.99) if estimated else None,
        "adaptive": bool(estimated and rng.random() < 0.3),
        "published": (published,) if percent or rng.random() < 0.4 else (),
        "device": some(
            OwnDynamics(damping_nspm=2.0, friction_n=0.1, mass_kg=0.25, sessions=3, of=int(rng.integers(3, 5))), 0.6
        ),
    }
    if summary == "settings":
        rows["settings"] = tuple(set_by(*whose) for whose in where)
    else:
        rows["answers"] = tuple(
            answered(person, standard, level, catch)
            for standard in standards for level in levels for catch in ((False, True) if catches else (False,))
            for person in whom if person is None or rng.random() < 0.9
        )  # fmt: skip
    return _block(design, vary, ends, standards, number), replace(level_result, **more, statistics=rows)


def _block(design: str, vary: str, ends: Any, standards: list[Any], number: int) -> LevelBlock:
    stimulus = Stimulus(vary=vary, levels=ends, standards=tuple(standard for standard in standards if standard))
    method = (Constant(), QuestPlus(), UpDown(rule="3down1up"), QuestPlus(learn="all"))[number % 4]
    kind = Rated(kind="rating", scale="s") if design == "rating" else default_design(design)
    return LevelBlock("b", "Block", "main", kind, stimulus, (), method)


def lines_of(number: int) -> Iterator[str]:
    block, level_result = random_block(number)
    failures = Failures()
    around = study(delays([0, 50]), list(everybody(delays([0, 50]), 3, lambda *_: 4)))
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(figure_style, "file_bytes", stub_png)
        drawable = not Thresholds.participant_rows(level_result) or (
            len({counts.standard for counts in Answers.rows_in(level_result)}) > 1 and not level_result.adaptive
        )
        pictures = (
            list(draw_figures(level_figure_tasks(around, [level_result], ("png",)), failures)) if drawable else []
        )
    assert not failures.found, str(failures.found)
    for picture in pictures:
        yield from (picture.caption, *figure_words(picture.files["png"]))
    yield from page_lines("".join(level_section(level_result, pictures, ("kalman", None)[number % 2])))
    yield from level_findings(level_result)
    yield from level_limits(level_result)
    yield from level_methods([block], [level_result])


@pytest.mark.parametrize("part", [0, pytest.param(4, marks=pytest.mark.slow)])
def test_a_block_with_missing_numbers(part: int, pytestconfig: pytest.Config) -> None:
    golden_file = GOLDEN / Path(f"levels-{part}.txt")
    all_lines = (line for number in range(6 * part, 6 * part + 6) for line in (f"== {number}", *lines_of(number)))
    compare(golden_file, each_once(all_lines), pytestconfig, mask=CHANGING)


CELLS = {
    "thresholds": {"Standard": "standard", "threshold": "threshold", "PSE": "threshold", "95 % interval": "low high",
                   "at": "compared", "width": "width", "flat width prior": "flat_width",
                   "mean of reversals": "reversal_mean", "fit": "fit_p", "drift": "drift"},
    "exponents": {"exponent": "exponent", "95 % interval": "low high"},
    "settings": {"Standard": "standard", "PSE": "pse", "95 % interval": "low high", "JND": "jnd",
                 "mean setting": "pse", "SD": "jnd",
                 "constant error": "constant_error", "hysteresis": "hysteresis"},
    "sensitivities": {"d′": "d_prime", "95 % interval": "low high", "c": "criterion", "k": "criterion"},
    "conduct": {"Standard": "standard", "trials": "trials", "repeated attempts": "repeated", "measured": "measured",
                "mean level error": "error_mean", "largest": "error_largest", "RMS hand speed": "pace_mps",
                "apparent mass": "apparent_mass_kg"},
    "catches": {"session": "session", "n": "n", "incorrect": "wrong"},
    "withheld": {"Standard": "standard", "intervals": "n", "mean": "mean_percent", "maximum": "most_percent"},
}  # fmt: skip
"""The numbers of a row that each column of the report's tables of levels shows."""
OTHER_CELLS = {
    "Participant", "Standard", "Comparison", "Level", "levels", "standards", "n", "with device damping", "percentage",
    "rule", "JND",
}  # fmt: skip
"""Columns with names, and those computed from several numbers."""
NUMBER = re.compile(r"-?\d*\.?\d+(?:e[+-]\d+)?")


def test_each_column_of_a_table_of_levels_shows_its_number() -> None:
    checked = set()
    for number in range(36):
        level_result = random_block(number)[1]
        for statistic in statistics():
            has_table = statistic.rows_in(level_result) and statistic.table_columns is not LevelStatistic.table_columns
            columns = statistic(level_result).table_columns() if has_table else ()
            for title, cell_of in (column for column in columns if column is not None):
                heading = re.sub(r" [\[(].*| [\d.]+ %$", "", title)
                if (heading in OTHER_CELLS or heading[0] == "“") and heading not in CELLS.get(statistic.key, ()):
                    continue
                for row in statistic.rows_in(level_result):
                    values = [
                        row[name] if isinstance(row, dict) else getattr(row, name)
                        for name in CELLS[statistic.key][heading].split()
                    ]
                    numbers = [float(text) for text in NUMBER.findall(cell_of(row).replace("−", "-"))]
                    assert numbers == ([] if None in values else pytest.approx(values, rel=0.05, abs=0.006)), title
                    checked |= {(statistic.key, heading)} if numbers else set()
    assert checked == {(key, heading) for key, headings in CELLS.items() for heading in headings}


def test_the_answers_at_a_level_are_percentages_only_if_they_are_proportions() -> None:
    checked = set()
    for number in range(24):
        level_result = random_block(number)[1]
        answers = [row for row in Answers.rows_in(level_result) if row.participant is None and not row.catch]
        if level_result.adaptive or not answers:
            continue
        page = "".join(Answers(level_result).section())
        for row in answers:
            percentage, plain = f"{100 * row.value:.0f} %", f"{row.value:.3g}"
            expected, other = (percentage, plain) if level_result.summary == "share" else (plain, percentage)
            assert f">{expected}</td>" in page
            assert f">{other}</td>" not in page or other in {f"{row.comparison:g}", f"{row.level:g}"}
        checked.add(level_result.summary)
    assert checked == {"share", "mean", "geometric mean"}


HAS_UNIT_OF_LEVELS = {"threshold": True, "pse": True, "exponent": False, "d_prime": False, "value": False}


def test_each_sentence_of_the_first_page_on_levels_states_the_estimate_with_its_own_unit() -> None:
    checked = set()
    for number in range(60):
        level_result = random_block(number)[1]
        if (estimates := estimates_of(level_result)) is None:
            continue
        attribute, is_weber = estimates.attribute, level_result.level_kind == "weber"
        unit = f" {level_result.unit}" if HAS_UNIT_OF_LEVELS[attribute] and not is_weber else ""
        before = "a Weber fraction of " if HAS_UNIT_OF_LEVELS[attribute] and is_weber else ""
        sentences = first_page._estimate_sentences(level_result, estimates.group, attribute, estimates.words)
        for row, sentence in zip(estimates.group, sentences, strict=True):
            assert sentence.startswith(f"The mean {estimates.words} "), sentence
            match = re.search(rf" was {before}(-?[\d.e-]+){unit} \((.+), n = (\d+)\)\.$", sentence.replace("−", "-"))
            assert match is not None, sentence
            assert float(match[1]) == pytest.approx(getattr(row, attribute), rel=0.01)
            ends = [float(text) for text in NUMBER.findall(match[2].removeprefix("95 % "))]
            assert ends == ([] if None in (row.low, row.high) else pytest.approx([row.low, row.high], rel=0.01))
            assert int(match[3]) == getattr(row, "participants", row.n)
            checked.add((attribute, is_weber))
    assert {attribute for attribute, _ in checked} == set(HAS_UNIT_OF_LEVELS)
    assert {("threshold", True), ("threshold", False), ("pse", True), ("pse", False)} <= checked
