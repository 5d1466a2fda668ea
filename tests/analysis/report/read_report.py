"""A report as its reader sees it."""

import csv
import io
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from tests.analysis.conftest import Results

FORBIDDEN = re.compile(
    r"(?i:no (significant |measurable |visible )?(effect|difference was|influence|impact)|\bhad no\b)"
    r"|\bnan\b|\bNaN\b|\binf\b|\bNone\b|[{}]"
)
"""What no report may say: that there is nothing, a number that is none, or a template that was not filled."""


class Text(HTMLParser):
    """Collect the visible text, and check that every element is closed correctly."""

    VOID = frozenset({"meta", "img", "br"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.told: list[str] = []
        self.tags: set[str] = set()
        self.fetched: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        assert re.fullmatch(r"[a-z0-9 -]*", dict(attrs).get("class") or ""), attrs
        self.fetched += [value or "" for name, value in attrs if name in ("src", "href")]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if not {"style", "svg"} & set(self.open):
            self.told.append(data)


def seen(html: str) -> str:
    """Return the visible text of HTML; check that its elements are closed and that it has no scripts."""
    page = Text()
    page.feed(html)
    assert page.open == []
    assert not page.tags & {"script", "link", "iframe", "object", "form"}
    assert all(place.startswith(("data:image/png;base64,", "#part-", "#top")) for place in page.fetched)
    return re.sub(r"\s+", " ", " ".join(page.told))


def read(folder: Path) -> str:
    """Return the visible text of the report page."""
    visible_text = seen((folder / "report.html").read_text(encoding="utf-8"))
    assert (match := FORBIDDEN.search(visible_text)) is None, visible_text[
        max(0, match.start() - 80) : match.end() + 40
    ]
    return visible_text


def numbers(folder: Path) -> dict[str, Any]:
    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    content: dict[str, Any] = json.loads((folder / "report.json").read_bytes(), parse_constant=refuse)
    return content


def rows(folder: Path, name: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO((folder / name).read_text(encoding="utf-8"))))


def answered_by_two(small: Results) -> None:
    for number_ in (1, 2):
        small.add(f"P{number_:03d}", lambda condition, _item: 6 if condition == "heavyzembla" else 3)


def run_in_r(folder: Path) -> subprocess.CompletedProcess[str]:
    if shutil.which("Rscript") is None:
        pytest.skip("no Rscript here: the script of the report is not run")
    return subprocess.run(["Rscript", "report.R"], cwd=folder, capture_output=True, text=True, check=False)
