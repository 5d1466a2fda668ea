"""The list of pages in Help, its search, and the text of a page for a reader without HTML."""

import re
from pathlib import Path

import pytest

from study_app import documentation
from study_app.gui.help.view import anchor_of, help_entries, matching_entries, page_markdown


def test_every_page_is_listed_once_below_the_heading_of_its_section() -> None:
    rows = help_entries()
    assert sorted(row.page for row in rows) == list(documentation.names())
    assert [row.page for row in rows if row.is_heading] == ["index", *documentation.sections()]
    names = [row.page for row in rows]
    assert names.index("begin") < names.index("first-session") < names.index("do")


ASKED = [
    line.split(" | ", 3)
    for line in Path(__file__).with_name("asked.txt").read_text("utf-8").splitlines()
    if line and not line.startswith("#")
]


@pytest.mark.parametrize(("words", "page", "answer"), [case[1:] for case in ASKED], ids=[case[0] for case in ASKED])
def test_the_words_of_a_reader_find_the_page_with_the_answer_first(words: str, page: str, answer: str) -> None:
    assert matching_entries(words)[0].page == page
    assert answer in " ".join(documentation.page(page).split())


def test_a_search_finds_words_that_begin_alike_the_best_page_first_at_its_heading() -> None:
    assert matching_entries("") == help_entries()
    pages = [row.page for row in matching_entries("photodiodes zebra")]
    assert pages[0] == "photodiode"
    assert "timing" in pages
    assert matching_entries("zebra") == ()
    assert not any(row.is_heading for row in matching_entries("photodiode"))
    assert (matching_entries("full disks")[0].page, matching_entries("full disks")[0].anchor) == ("year", "a-full-disk")
    assert next(row.page for row in matching_entries("spss")) == "export"  # a list of pages comes after them


def test_a_search_finds_generated_parts() -> None:
    assert "data-dictionary" in [row.page for row in matching_entries("lateness_p99_ms")]
    assert "protocol-format" in [row.page for row in matching_entries("breaking_span_m")]
    assert "commands" in [row.page for row in matching_entries("--answers-only")]


def test_texts_have_neither_comments_nor_html_nor_empty_cells() -> None:
    for page in documentation.names():
        text = page_markdown(page)
        prose = re.sub(r"```.*?```|`[^`]*`", "", text, flags=re.DOTALL)
        assert "<!--" not in text, page
        assert not re.search(r"<(img|details|summary|b)\b", prose), page
        assert "| |" not in text, page


def test_anchors_match_those_of_links() -> None:
    assert anchor_of("Tables and report") == "tables-and-report"
    assert anchor_of("“125 ms” & more: a test?") == "125-ms--more-a-test"
