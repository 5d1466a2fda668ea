"""What the window Help shows: the pages by section, as text for a reader that knows Markdown and no HTML."""

import re
from dataclasses import dataclass
from functools import cache
from typing import Final

from study_app import documentation

FIRST_PAGE: Final = documentation.INDEX
PAGES_OF_PLACES: Final = {
    "home": "first-session",
    "designer": "designer",
    "results": "answers-to-report",
    "lab": "lab",
    "devices": "devices",
    "machine": "this-machine",
}
"""The page about each place of the main window."""

_COMMENT: Final = re.compile(r"<!--.*?-->\n*", re.DOTALL)
_HTML_IMAGE: Final = re.compile(r'<img src="([^"]+)"[^>]*alt="([^"]*)"[^>]*>')
_EMPTY_CELL: Final = re.compile(r"(?<=\|) *(?=\|)")
_INLINE_MARKS: Final = re.compile(r"[`*\\]|\[([^]]*)\]\([^)]*\)")


@dataclass(frozen=True, slots=True)
class HelpEntry:
    """One row of the list of pages: its page, its title, and whether it heads a section."""

    page: str
    title: str
    heads: bool = False


@cache
def entries() -> tuple[HelpEntry, ...]:
    """Return the pages in the order of the sections, each section after its own page."""
    rows = [HelpEntry(FIRST_PAGE, "Start page", heads=True)]
    for section, pages in documentation.sections().items():
        rows.append(HelpEntry(section, _plain(documentation.title(section)), heads=True))
        rows += [HelpEntry(page, _plain(documentation.title(page))) for page in pages]
    return tuple(rows)


def found(words: str) -> tuple[HelpEntry, ...]:
    """Return the pages that contain all words, those with them in the title first; all pages for no words."""
    wanted = words.casefold().split()
    if not wanted:
        return entries()
    pages = [entry for entry in entries() if all(word in _searched(entry.page) for word in wanted)]
    pages.sort(key=lambda entry: -sum(word in entry.title.casefold() for word in wanted))
    return tuple(HelpEntry(entry.page, entry.title) for entry in pages)


@cache
def _searched(page: str) -> str:
    return documentation.page(page).casefold()


@cache
def text_of(page: str) -> str:
    """Return a page as Markdown without comments and HTML."""
    text = _HTML_IMAGE.sub(r"![\2](\1)", _COMMENT.sub("", documentation.page(page)))
    return "\n".join(_row(line) if line.startswith("|") else line for line in text.split("\n"))


def _row(line: str) -> str:
    """Return a row of a table without empty cells, which Qt joins with the ones before."""
    return _EMPTY_CELL.sub("\N{NO-BREAK SPACE}", line)


def anchor_of(heading: str) -> str:
    """Return the anchor of a heading as it is shown, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


def _plain(title: str) -> str:
    return _INLINE_MARKS.sub(lambda mark: mark[1] or "", title)
