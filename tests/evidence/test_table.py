"""The table of all evidence: text and numbers aligned in plain text, Markdown and CSV."""

import pytest

from study_app.evidence.table import Table

HEADINGS, ROWS = ("it", "n", "note"), (("drag", 7, "a"), ("wake", 1200, "bcdef"))


@pytest.mark.parametrize(
    ("left", "text", "marks"),
    [
        (0, ["  it     n   note", "drag     7      a", "wake  1200  bcdef"], "| --: | --: | --: |"),
        (1, ["it       n   note", "drag     7      a", "wake  1200  bcdef"], "| --- | --: | --: |"),
        ((0, 2), ["it       n  note", "drag     7  a", "wake  1200  bcdef"], "| --- | --: | --- |"),
    ],
)
def test_texts_are_aligned_left_and_numbers_right(left: int | tuple[int, ...], text: list[str], marks: str) -> None:
    table = Table(HEADINGS, ROWS, left=left)
    assert table.text().splitlines() == text
    assert table.markdown().splitlines() == ["| it | n | note |", marks, "| drag | 7 | a |", "| wake | 1200 | bcdef |"]
    assert table.csv().splitlines() == ["it,n,note", "drag,7,a", "wake,1200,bcdef"]
