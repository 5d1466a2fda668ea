import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.analysis.tables import measures


def table(rows: list[tuple[str, str, str, float | None]], *, cannot_judge: tuple[int, ...] = ()) -> pd.DataFrame:
    frame = pd.DataFrame(rows, columns=["participant", "code", "item", "response"])
    frame["response"] = frame["response"].astype("Int64")
    frame["cannot_judge"] = [row in cannot_judge for row in range(len(rows))]
    return frame


def of_one(values: list[int]) -> pd.Series:
    rows = [(f"P{number}", "L1", "a", value) for number, value in enumerate(values)]
    return measures.aggregate(table(rows), {"L1": len(values)}, ["L1"], ["a"]).iloc[0]


def test_counts_keep_all_seven_levels_where_the_lowest_three_never_occur() -> None:
    row = of_one([4, 5, 5, 6, 7, 7, 7])
    assert [row[column] for column in measures.COUNT_COLUMNS] == [0, 0, 0, 1, 2, 1, 3]
    assert row["n"] == 7
    assert row["agree_percent"] == pytest.approx(600 / 7)


def test_quartiles_are_linear_type_7() -> None:
    row = of_one([1, 2, 4, 7])
    assert (row["q1"], row["median"], row["q3"]) == (1.75, 3.0, 4.75)


def test_no_answer_and_cannot_judge_are_counted_apart_and_are_no_level() -> None:
    rows = [("P1", "L1", "a", 4), ("P2", "L1", "a", None), ("P3", "L1", "a", None)]
    row = measures.aggregate(table(rows, cannot_judge=(1,)), {"L1": 4}, ["L1"], ["a"]).iloc[0]
    assert (row["n"], row["cannot_judge"], row["missing"], row["presented"]) == (1, 1, 2, 4)
    assert sum(row[column] for column in measures.COUNT_COLUMNS) == 1


def test_a_statement_without_any_answer_has_no_median() -> None:
    found = measures.aggregate(table([("P1", "L1", "a", 4)]), {"L1": 1}, ["L1", "L2"], ["a", "b"])
    assert list(zip(found["code"], found["item"], strict=True)) == [("L1", "a"), ("L1", "b"), ("L2", "a"), ("L2", "b")]
    assert found.iloc[1:][["median", "q1", "q3", "agree_percent"]].isna().all(axis=None)
    assert found.iloc[1]["missing"] == 1
    assert found.iloc[2]["missing"] == 0


@pytest.mark.slow
@given(st.lists(st.integers(1, 7), min_size=1, max_size=40), st.randoms(use_true_random=False))
def test_the_order_of_participants_changes_nothing_and_reversing_the_scale_mirrors(values: list[int], mixer) -> None:
    row = of_one(values)
    mixed = list(values)
    mixer.shuffle(mixed)
    assert of_one(mixed).equals(row)
    mirrored = of_one([8 - value for value in values])
    assert [mirrored[column] for column in measures.COUNT_COLUMNS] == [
        row[column] for column in reversed(measures.COUNT_COLUMNS)
    ]
    assert mirrored["median"] == 8 - row["median"]
    assert mirrored["q1"] == pytest.approx(8 - row["q3"])


def test_by_participant_takes_the_median_of_repeats_and_leaves_gaps() -> None:
    rows = [
        ("P1", "D1", "a", 2),
        ("P1", "D1", "a", 5),
        ("P2", "D2", "a", 7),
        ("P2", "D1", "a", None),
        ("P1", "D2", "b", 1),
    ]
    found = measures.by_participant(table(rows), ["P1", "P2"], {"D1": 0, "D2": 1}, "a")
    np.testing.assert_array_equal(found, [[3.5, np.nan], [np.nan, 7.0]])
