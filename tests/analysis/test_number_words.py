"""Numbers in sentences and table cells of the report."""

import pytest

from study_app.analysis.wording import listed, number, percent, significant, whole_percent


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.0, "0 %"), (0.0004, "< 0.1 %"), (0.0005, "0.05 %"), (0.0625, "6.25 %"), (0.958, "95.8 %"),
        (0.9994, "99.9 %"), (0.9995, "> 99.9 %"), (0.99999, "> 99.9 %"), (1.0, "100 %"),
    ],
)  # fmt: skip
def test_a_share_is_never_rounded_to_0_or_100_percent(share: float, text: str) -> None:
    assert percent(share) == text


@pytest.mark.parametrize(
    ("value", "decimals", "text"),
    [
        (None, 2, "–"), (0.126, 2, "0.13"), (-0.126, 2, "−0.13"), (-0.004, 2, "0.00"), (1.234, 3, "1.23"),
        (98.76, 2, "98.8"), (-987.6, 1, "−988"), (12345.6, 2, "12346"),
    ],
)  # fmt: skip
def test_a_number_has_its_decimals_but_at_most_three_digits(value: float | None, decimals: int, text: str) -> None:
    assert number(value, decimals) == text


@pytest.mark.parametrize(
    ("value", "text"), [(0.0030512, "0.00305"), (1.25, "1.25"), (1.0, "1"), (-2.3456, "−2.35"), (43210.0, "43200")]
)
def test_significant_digits_do_not_end_in_zeros(value: float, text: str) -> None:
    assert significant(value) == text


def test_other_words() -> None:
    assert [whole_percent(share) for share in (0.0, 0.956, 1.0)] == ["0 %", "96 %", "100 %"]
    assert [listed(names) for names in (["a"], ["a", "b"], ["a", "b", "c"])] == ["a", "a and b", "a, b and c"]
