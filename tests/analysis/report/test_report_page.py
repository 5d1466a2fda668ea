"""The report's page at any width: cells on one line, figures as large as their letters need."""

import re

import pytest

from study_app.analysis.report import typeface
from study_app.analysis.report.html_page import page
from study_app.analysis.report.typeface import font_faces


def style(media: str = "") -> str:
    """Return the rules of the style for all media, or of one of its media alone."""
    rules = re.search(r"<style>(.*)</style>", page("", ""), re.DOTALL)
    assert rules is not None
    everywhere, *special = rules[1].split("@media ")
    return next(part for part in special if part.startswith(media)) if media else everywhere


@pytest.mark.slow
def test_a_page_without_the_typeface_is_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    assert font_faces("abc").count("@font-face") == 2
    assert font_faces("abc") == font_faces("abc")
    assert len(font_faces("abc")) < len(font_faces("abcdefghij–≤χ²"))
    monkeypatch.setattr(typeface, "WEIGHTS", {400: "Absent"})
    assert font_faces("abc") == ""
    assert page("Title", "body", font_faces("abc")).rstrip().endswith("</html>")
