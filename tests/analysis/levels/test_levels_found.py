"""The answers to levels of each design are those that are counted here from the table of trials."""

import math
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from study_app.analysis.data.blocks import LevelBlock, Setting
from study_app.analysis.levels import thresholds, tracks
from study_app.analysis.levels.answers import Answers
from study_app.analysis.levels.evaluate import level_results
from study_app.analysis.levels.statistic import statistics
from study_app.analysis.results import LevelsResult
from study_app.protocol.trials.designs import Rated
from study_app.protocol.trials.stimuli import Stimulus
from tests.analysis.levels.level_studies import ONE, STIMULUS, block
from tests.analysis.made_up import delays, everybody, study

LINK = Stimulus(vary="force_delay_ms", levels=(0, 100), standards=(10.0, 20.0), spacing="linear")
CONDITIONS = tuple(
    Setting(code=f"V{number}", condition=name) for number, name in enumerate(("water", "honey"), start=1)
)
BLOCKS = {
    "forced choice": replace(block("2ifc", STIMULUS, ONE), wrong_most=0.2),
    "rating": block(
        Rated(kind="rating", scale="s"),
        LINK,
        (Setting(code="V1", condition="10/1"), Setting(code="V2", condition="20/1")),
    ),
    "estimation": block("estimation", STIMULUS, ONE),
    "conditions": block("2ifc", None, CONDITIONS),
}


def rows(block: LevelBlock, seed: int) -> list[dict[str, Any]]:
    """Return two participants' answers to levels of each standard, with catch trials and one trial not analysed."""
    draw, trial_rows = np.random.default_rng(seed), []
    stimulus = block.stimulus
    count = 10 if stimulus is LINK else 3
    for person in ("P001", "P002"):
        for trial in range(1, 37):
            standard = stimulus.standards[trial % len(stimulus.standards)] if stimulus else None
            level = stimulus.spaced(count)[trial // len(stimulus.standards) % count] if stimulus else None
            arrangement = trial % max(1, len(block.design.arrangements))
            choices = sorted(block.design.answers, key=lambda answer: not block.design.is_correct(arrangement, answer))
            right = bool(draw.random() < 0.4 + 0.5 * (trial % 3) / 2)
            letters = block.design.arrangement_text(arrangement) if block.design.arrangements else "C"
            trial_rows.append(
                {
                    "participant": person, "session": 1, "trial": trial, "block": block.id, "code": "V1",
                    "track": "honey" if stimulus is None and trial % 2 else "water" if stimulus is None else "8/1",
                    "catch": trial % 9 == 0 and stimulus is not None, "standard": standard, "level": level,
                    "level_delivered": level and level * (1.02 if trial % 5 else 0.97), "comparison": None,
                    "outcome": "completed", "arrangement": letters, "analysed": trial != 5, "reversal": trial % 7 == 0,
                    "response": choices[not right] if choices else str(trial), "success": right, "right": right,
                    "value": round(float(draw.lognormal()), 3) if block.design.reply == "number" else 1 + trial % 5,
                    "response_s": round(float(draw.lognormal(0.2, 0.3)), 3), "setting": None,
                }
            )  # fmt: skip
    return trial_rows


def intervals(opened: pd.DataFrame) -> pd.DataFrame:
    """Return the presented intervals: every fifth trial was repeated, with a reason, and force was withheld."""
    presented = opened.assign(attempt=1, counted=True, presented="comparison", pace_mps=0.1 + opened["trial"] / 1000)
    presented["withheld_share"] = (opened["trial"] % 4) / 10
    presented["apparent_mass_kg"] = opened["trial"] / 100
    again = presented[presented["trial"] % 5 == 0]
    standards = presented.assign(presented="standard", withheld_share=0.9)
    last = again.assign(attempt=2), again.assign(attempt=2, presented="standard", withheld_share=0.8)
    first = presented.assign(
        counted=presented["trial"] % 5 > 0, invalid_reasons=np.where(presented["trial"] % 5 == 0, "pace late", None)
    )
    return pd.concat([first, standards, *last])


def test_answers_to_levels_are_counted_by_hand() -> None:
    every = [replace(block, id=name, title=name.capitalize()) for name, block in BLOCKS.items()]
    frame = pd.DataFrame([row for seed, block in enumerate(every) for row in rows(block, seed)])
    intervals_frame = frame.astype(
        {"level_delivered": "Float64", **dict.fromkeys(("success", "right", "catch"), "boolean")}
    )
    case_study = study(delays([0, 50]), list(everybody(delays([0, 50]), 2, lambda *_: 4)))
    answered = intervals_frame.assign(
        onset_s=1.0, first_choice_s=1.0 + intervals_frame["response_s"], counted=intervals_frame["analysed"]
    )
    levels_study = replace(case_study, levels=tuple(every), intervals=intervals(intervals_frame), answered=answered)
    results = level_results(levels_study, intervals_frame)
    assert [result.block for result in results] == list(BLOCKS)
    for result in results:
        trials = intervals_frame[(intervals_frame["block"] == result.block) & intervals_frame["analysed"]]
        answers = Answers.rows_in(result)
        assert answers
        assert sum(row.n for row in answers if row.participant is None) == len(trials)
        for row in answers:
            of_row = trials[trials["catch"].astype(bool) == row.catch]
            if row.participant is not None:
                of_row = of_row[of_row["participant"] == row.participant]
            if row.standard is not None:
                of_row = of_row[of_row["standard"] == row.standard]
            if row.level is not None:
                of_row = of_row[np.isclose(of_row["level"].astype(float), row.level)]
            if row.comparison is not None:
                of_row = of_row[of_row["track"] == row.comparison]
            assert (row.n, row.participants) == (len(of_row), of_row["participant"].nunique()), row
            if result.summary == "share":
                assert row.count == of_row["success"].sum(), row
                assert row.value == pytest.approx(of_row["success"].astype(float).mean()), row
            elif row.participant is not None:
                values = of_row["value"].astype(float)
                middle = np.exp(np.log(values).mean()) if result.block == "estimation" else values.mean()
                assert row.value == pytest.approx(middle), row
            assert row.low is None or row.low <= row.value <= row.high, row


@pytest.mark.parametrize("most", [0.2, None])
def test_incorrect_answers_to_catch_trials_are_counted_by_session(most: float | None) -> None:
    """Other blocks, other trials and trials without an answer do not count."""
    marks_of = {("P001", 1): "xx+", ("P001", 2): "+x++", ("P002", 1): "x"}
    catch_rows = [
        (*visit, block, catch, {"x": False, "+": True}.get(mark))
        for visit, marks in marks_of.items()
        for block, catch, answers in (
            ("b", True, f"{marks}-"),
            ("b", False, "xxx"),
            ("b", None, "x"),
            ("c", True, "xx"),
        )
        for mark in answers
    ]
    frame = pd.DataFrame(catch_rows, columns=["participant", "session", "block", "catch", "right"])
    catch_frame = frame.astype(dict.fromkeys(("catch", "right"), "boolean"))
    expected = [] if most is None else [("P001", 1, 3, 2, most), ("P001", 2, 4, 1, most), ("P002", 1, 1, 1, most)]
    rows = keyed("catches").compute(replace(BLOCKS["forced choice"], wrong_most=most), catch_frame, None, None)
    names = ("participant", "session", "n", "wrong", "most")
    assert list(rows) == [dict(zip(names, count, strict=True)) for count in expected]


VISIT = {"participant": "P001", "session": 1, "block": "b"}
LEVEL_ERROR = (
    "Level error is the delivered level minus the requested level, computed from the recorded samples (for delays, "
    "from the frames); fits use the delivered levels."
)


def keyed(key: str) -> Any:
    """Return a statistic by its key in report.json."""
    return next(statistic for statistic in statistics() if statistic.key == key)


def statistic_with_rows(key: str, rows: Sequence[Any], **about: Any) -> Any:
    """Return a statistic with these rows, to be shown in the report."""
    about = {"summary": "share", "counts": "correct", "statistics": {key: tuple(rows)}, **about}
    result = LevelsResult(block="b", title="B", design="2ifc", revealed=True, times=(), **about)
    return keyed(key)(result, estimator="kalman")


def cells(statistic: Any) -> list[list[str]]:
    """Return the headings of a statistic's table in the report, and the cells of its rows."""
    columns = [column for column in statistic.table_columns() if column is not None]
    return [[heading for heading, _ in columns], *([cell(row) for _, cell in columns] for row in statistic.rows)]


def test_the_delivery_of_each_standard_counts_analysed_trials_and_averages_their_last_attempts() -> None:
    presentations = [  # trial, standard, level, level_delivered, analysed; a level of 0 has no error
        (1, 4.0, 0.2, 0.25, True), (2, 4.0, 0.4, 0.31, True), (3, 4.0, 0.0, 0.9, True), (4, 4.0, 0.3, None, True),
        (5, 8.0, 0.5, 0.44, True), (6, 8.0, 0.1, 0.7, False), (7, math.nan, 0.6, 0.61, True),
    ]  # fmt: skip
    names = ["trial", "standard", "level", "level_delivered", "analysed"]
    intervals_frame = pd.DataFrame(presentations, columns=names).astype({"level_delivered": "Float64"}).assign(**VISIT)
    other = intervals_frame.assign(block="other", trial=intervals_frame["trial"] + 20)
    presented = [  # trial, attempt, counted, reasons, speed, mass
        (1, 1, False, "slip pace_error_percent", 5.0, 1.0), (1, 1, False, "slip slip", 5.0, 1.0),
        (1, 2, True, None, 0.11, 0.021), (1, 2, True, None, 0.13, 0.023),
        (2, 1, True, "pace_error_percent", 0.2, 0.05), (2, 1, True, "pace_error_percent", 0.24, 0.066),
        (5, 1, False, "slip", 5.0, 1.0), (5, 2, False, "slip", 5.0, 1.0), (5, 3, True, None, 0.31, None),
        (6, 1, True, "slip", 5.0, 1.0), (6, 2, True, "late", 5.0, 1.0), (21, 1, True, "late", 5.0, 1.0),
    ]  # fmt: skip
    names = ["trial", "attempt", "counted", "invalid_reasons", "pace_mps", "apparent_mass_kg"]
    intervals = pd.DataFrame(presented, columns=names).assign(**VISIT)
    intervals["block"] = np.where(intervals["trial"] > 20, "other", "b")
    study, delivery = SimpleNamespace(intervals=intervals), keyed("conduct")
    first, second, third = delivery.compute(block(), pd.concat([intervals_frame, other]), study, None)
    rows = first, second, third
    assert [row.pop("reasons") for row in map(dict, rows)] == [{"pace_error_percent": 3, "slip": 2}, {"slip": 2}, {}]
    of_4 = {"trials": 4, "repeated": 1, "measured": 2, "error_mean": -0.02, "error_largest": 0.09}
    of_8 = {"trials": 1, "repeated": 2, "measured": 1, "error_mean": -0.06, "error_largest": 0.06}
    last = {"trials": 1, "repeated": 0, "measured": 1, "error_mean": 0.01, "error_largest": 0.01}
    for row, expected in (
        (first, of_4 | {"standard": 4.0, "pace_mps": 0.17, "apparent_mass_kg": 0.04}),
        (second, of_8 | {"standard": 8.0, "pace_mps": 0.31, "apparent_mass_kg": None}),
        (third, last | {"standard": None, "pace_mps": None, "apparent_mass_kg": None}),
    ):
        assert {name: value for name, value in row.items() if name != "reasons"} == pytest.approx(expected)
    assert list(delivery.compute(replace(block(), stimulus=None), intervals_frame, study, None)) == []
    section = statistic_with_rows("conduct", rows, level_kind="difference", unit="mN")
    assert cells(section) == [
        ["Standard [mN]", "trials", "repeated attempts", "measured", "mean level error [mN]", "largest",
         "RMS hand speed [m/s]", "apparent mass [kg]"],
        ["4", "4", "1", "2", "−0.020", "0.090", "0.170", "0.040"],
        ["8", "1", "2", "1", "−0.060", "0.060", "0.310", "–"],
        ["–", "1", "0", "1", "0.010", "0.010", "–", "–"],
    ]  # fmt: skip
    assert cells(statistic_with_rows("conduct", [third], level_kind="weber", unit="mN"))[0][:4] == [
        "trials", "repeated attempts", "measured", "mean level error",
    ]  # fmt: skip
    assert section.explanation() == (
        f"{LEVEL_ERROR} Apparent mass is the coefficient m in a least-squares fit of F = −b v − m a to the force sent "
        "to the device, using the velocity estimator “kalman”. Some intervals exceeded a limit: slip in four intervals "
        "and pace error in three intervals."
    )
    assert (
        statistic_with_rows("conduct", [third]).explanation() == f"{LEVEL_ERROR} All intervals were within the limits."
    )
    assert statistic_with_rows("conduct", [{**third, "measured": 0}]).explanation() == (
        f"{LEVEL_ERROR} The delivered levels were not measured, so it is not known whether they were within the limits."
    )


def test_a_session_is_excluded_if_more_catch_trials_than_the_limit_are_incorrect() -> None:
    counts = [("P001", 1, 2), ("P001", 3, 3)]
    rows = [
        {"participant": person, "session": session, "n": 8, "wrong": wrong, "most": 0.25}
        for person, session, wrong in counts
    ]
    assert cells(statistic_with_rows("catches", rows)) == [
        ["Participant", "session", "n", "incorrect", "percentage", "rule"],
        ["P001", "1", "8", "2", "25 %", "kept: at most 25 %"],
        ["P001", "3", "8", "3", "38 %", "excluded: more than 25 %"],
    ]


def test_the_force_held_back_is_given_for_comparisons_at_each_level_of_a_link() -> None:
    """Neighbouring ones of more than eight levels share a row."""
    shares = {
        (10.0, 20.0): (0.01, 0.03), (10.0, 40.0): (0.05,), (10.0, 60.0): (0.06, 0.41), (10.0, 80.0): (0.02,),
        (20.0, 50.0): (0.3,), **{(30.0, float(level)): (level / 1000,) for level in range(1, 10)},
    }  # fmt: skip
    rows = [
        (standard, level, "comparison", "b", share)
        for (standard, level), withheld in shares.items()
        for share in withheld
    ]
    rows += [(10.0, 20.0, "standard", "b", 0.9), (10.0, 20.0, "comparison", "other", 0.8)]
    rows += [(10.0, 20.0, "comparison", "b", None), (10.0, None, "comparison", "b", 0.7)]
    frame = pd.DataFrame(rows, columns=["standard", "level", "presented", "block", "withheld_share"])
    study, withheld = SimpleNamespace(intervals=frame), keyed("withheld")
    unknown = frame[:2].assign(standard=np.nan)
    withheld_rows = list(withheld.compute(replace(block(), stimulus=LINK), None, study, None))
    assert [list(row.values()) for row in withheld_rows[:5]] == [
        pytest.approx([10.0, 20.0, 20.0, 2, 2.0, 3.0]), pytest.approx([10.0, 40.0, 40.0, 1, 5.0, 5.0]),
        pytest.approx([10.0, 60.0, 60.0, 2, 23.5, 41.0]), pytest.approx([10.0, 80.0, 80.0, 1, 2.0, 2.0]),
        pytest.approx([20.0, 50.0, 50.0, 1, 30.0, 30.0]),
    ]  # fmt: skip
    assert list(withheld_rows[0]) == ["standard", "low", "high", "n", "mean_percent", "most_percent"]
    assert [(row["low"], row["high"], row["n"]) for row in withheld_rows[5:]] == [
        (1, 2, 2),
        *((n, n, 1) for n in range(3, 10)),
    ]
    (row,) = withheld.compute(replace(block(), stimulus=LINK), None, SimpleNamespace(intervals=unknown), None)
    assert (row["standard"], row["n"]) == (None, 2)
    for stimulus in (None, STIMULUS):
        assert list(withheld.compute(replace(block(), stimulus=stimulus), None, study, None)) == []
    section = statistic_with_rows("withheld", withheld_rows, unit="ms")
    table = cells(section)
    assert table[0] == ["Standard [ms]", "Level [ms]", "intervals", "mean", "maximum"]
    assert [table[3], table[6]] == [["10", "60", "2", "23.5 %", "41.0 %"], ["30", "1 – 2", "2", "0.2 %", "0.2 %"]]
    never = "the safety layer never held back more than 5 % of the force."
    assert section.explanation().startswith(
        f"In comparisons of up to 40 ms at a standard of 10 ms, {never} In at least one comparison at the lowest level "
        "at a standard of 20 ms, the safety layer held back more than 5 % of the force. In comparisons of up to 9 ms "
        f"at a standard of 30 ms, {never} The table shows"
    )
    alone = [row | {"standard": None} for row in withheld_rows[:1]]
    assert statistic_with_rows("withheld", alone).explanation().startswith(f"In comparisons of up to 20, {never}")


def test_the_mean_of_reversals_is_that_of_the_tracks_in_the_coordinate_of_the_stimulus(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The tracks of two people give 0.1 and 1.6 on log spacing, and the third none: 0.4, not 0.85."""
    rows = pd.DataFrame([(f"P{n}", 1, "b", "L1", n) for n in (0, 0, 1, 2)], columns=[*thresholds.TRACK, "track"])
    estimates = {0: 0.1, 1: 1.6, 2: None}
    method = SimpleNamespace(target_percent=75.0, reversal_mean=lambda setting, _answers: estimates[setting])
    stimulus: Any = SimpleNamespace(coordinate=math.log10, level_of=lambda u: 10.0**u)
    monkeypatch.setattr(thresholds, "setting_of", lambda _block, track: track)
    monkeypatch.setattr(thresholds, "answers_of", len)
    block: Any = SimpleNamespace(method=method)
    assert thresholds._reversal_mean(block, stimulus, rows) == pytest.approx(0.4)
    assert thresholds._reversal_mean(block, stimulus, rows[-1:]) is None


@pytest.mark.parametrize(
    ("kind", "correct", "two"), [("2ifc", True, True), ("2ifc", False, False), ("abx", True, False)]
)
def test_only_pairs_with_a_correct_answer_are_fitted_as_two_intervals(
    monkeypatch: pytest.MonkeyPatch, kind: str, correct: bool, two: bool
) -> None:
    fitted = SimpleNamespace(fit=lambda grid, *, two_intervals: (grid, two_intervals))
    monkeypatch.setattr(thresholds, "person_answers", lambda *_: fitted)
    stimulus = SimpleNamespace(analysis_grid=lambda *_: "grid")
    block: Any = SimpleNamespace(
        stimulus=stimulus, assumed="a", design=SimpleNamespace(kind=kind), has_correct_answer=correct
    )
    rows = pd.DataFrame({"participant": ["P1", "P2"], "session": [1, 1]})
    assert thresholds._flat_fits(block, rows) == {"P1": ("grid", two), "P2": ("grid", two)}


@pytest.mark.parametrize("design", ["abx", "samedifferent", "2ifc"])
def test_a_trial_with_sealed_intervals_is_not_analysed(design: str) -> None:
    sealed_block = block(design, STIMULUS, ONE)
    intervals = pd.DataFrame(
        {
            name: ["P001"] * sealed_block.design.intervals
            for name in ("participant", "session", "block", "trial", "attempt")
        }
        | {"interval": range(1, sealed_block.design.intervals + 1)}
        | dict.fromkeys(("presented", "standard", "level", "catch", "setting"), pd.NA)
        | dict.fromkeys(("value_delivered", "delay_error_mean_ms", *tracks.OF_INTERVALS), np.nan)
    )
    (presented,) = tracks._presentations(intervals).to_dict("records")
    answered = {
        "block": "b",
        "code": ONE[0].code,
        "index": 4,
        "counted": True,
        "response": next(iter(sealed_block.design.answers)),
    }
    row = tracks._track_row(sealed_block, presented | answered)
    assert row["analysed"] is False
    assert pd.isna(row["right"])
    assert pd.isna(row["success"])
