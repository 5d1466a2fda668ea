"""The report's page at any width: cells on one line, figures as large as their letters need."""

import re

import pytest

from study_app.analysis.report import typeface
from study_app.analysis.report.html_page import LONG, SHORT, page, picture, table
from study_app.analysis.report.typeface import font_faces

PNG = b"\x89PNG\r\n\x1a\n" + (13).to_bytes(4) + b"IHDR" + (2148).to_bytes(4) + (1000).to_bytes(4)


def style(media: str = "") -> str:
    """Return the rules of the style for all media, or of one of its media alone."""
    rules = re.search(r"<style>(.*)</style>", page("", ""), re.DOTALL)
    assert rules is not None
    everywhere, *special = rules[1].split("@media ")
    return next(part for part in special if part.startswith(media)) if media else everywhere


def test_only_sentences_are_broken_into_lines() -> None:
    cells = ["Statement", "Feels like a liquid", "x" * (LONG + 1), "x" * LONG, "x" * SHORT, "0.5"]
    made = table(cells, [cells], words=5)
    row = re.findall(r"<td([^>]*)>", made)
    assert row == ["", ' class="words"', ' class="long"', ' class="words"', "", ' class="n"']
    assert re.search(r"th, td \{ white-space: nowrap; \} td\.long \{ white-space: normal; \}", style())
    assert "width: max-content" in style()
    assert ".scroll { overflow-x: auto; }" in style()
    assert re.search(r"th, td\.words \{ white-space: normal; \}", style("print"))


def test_heads_of_tables_come_again_on_the_next_sheet_of_paper() -> None:
    assert re.match(r'<div class="scroll"><table><thead><tr><th>A</th></tr></thead><tbody><tr>', table("A", ["b"]))


def test_a_figure_keeps_its_width_on_a_narrow_window_and_is_moved_sideways() -> None:
    made = picture(PNG, "A figure.")
    assert '<div class="scroll"><img width="859" ' in made  # 8 points are 13 pixels
    assert "figure img { max-width: none; }" in style("(max-width: 600px)")
    assert "img { max-width: 100%; height: auto; }" in style()


@pytest.mark.slow
def test_a_page_without_the_typeface_is_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    assert font_faces("abc").count("@font-face") == 2
    assert font_faces("abc") == font_faces("abc")
    assert len(font_faces("abc")) < len(font_faces("abcdefghij–≤χ²"))
    monkeypatch.setattr(typeface, "WEIGHTS", {400: "Absent"})
    assert font_faces("abc") == ""
    assert page("Title", "body", font_faces("abc")).rstrip().endswith("</html>")
