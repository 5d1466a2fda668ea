"""The pages of the documentation, without Qt and without Sphinx: the website and the window Help read them here.

A page is plain Markdown. A comment in it, ``<!-- generated: MODULE:FUNCTION -->``, stands for what that function
returns. The pages of a section are those that the section's own page links to in its lists; all others are in
``_ELSE``.
"""

import math
import re
from functools import cache
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from typing import Final, NamedTuple

INDEX: Final = "index"
_ELSE: Final = "do"
"""The section of pages that no section lists."""

_LISTS: Final = ("commands", "data-dictionary", "kinds", "protocol-format")
"""Pages that consist of generated lists."""

_FOLDERS: Final = {"decisions": "look-up"}
"""The section of pages in a folder that no section lists."""

_GENERATED: Final = re.compile(r"<!-- generated: ([\w.]+):(\w+) -->")
_LISTED: Final = re.compile(r"^- \[[^]]+\]\(([\w/-]+)\.md\)", re.MULTILINE)
_TITLE: Final = re.compile(r"^# (.+)$", re.MULTILINE)

_GLOSSARY: Final = "glossary"
"""The page that shows the words of `_SYNONYMS`; a search leaves them out."""

_SYNONYMS: Final = "search-words.txt"
"""The file of words that no page has to contain: in each line a page, perhaps its anchor, and the words about it."""

_ROW: Final = re.compile(r"^([\w/-]+)(?:#([\w-]+))?: (.+)$", re.MULTILINE)
_MARKS: Final = re.compile(r"[`*\\]|\[([^]]*)\]\([^)]*\)")
_FENCED_OR_HEADING: Final = re.compile(r"^```.*?^```|^#+ ([^\n]+)$", re.MULTILINE | re.DOTALL)
_WORD: Final = re.compile(r"\w[\w-]*")
_ENDING: Final = re.compile(r"(?<=\w{3})(?:ies|ings?|ed|es|s|e|y)$")
_NO_MATTER: Final = (
    "a about after an and are at be before by can could do does for from get give gives got has have how i if in is "
    "it know many may me my need no not of ok on one or our should that the their there they this to two want was we "
    "what when where which who why will with would you"
)


def folder() -> Path:
    """Return the folder of the pages, in the installed package or in the checkout."""
    package = Path(str(files("study_app")))
    installed = package / "docs"
    return installed if installed.is_dir() else package.parent / "docs"


@cache
def names() -> tuple[str, ...]:
    """Return the sorted names of all pages, which are their paths in the folder without the suffix."""
    top = folder()
    paths = (path.relative_to(top) for path in top.rglob("*.md"))
    return tuple(sorted(path.with_suffix("").as_posix() for path in paths if path.parts[0] != "examples"))


def source(name: str) -> str:
    """Return the text of a page as in its file."""
    return (folder() / f"{name}.md").read_text(encoding="utf-8")


def page(name: str) -> str:
    """Return a page as Markdown, with its generated parts."""
    return with_generated_parts(source(name))


def with_generated_parts(text: str) -> str:
    """Return the text of a page in which each comment that names a function is replaced by its output."""
    return _GENERATED.sub(lambda found: getattr(import_module(found[1]), found[2])(), text)


def title(name: str) -> str:
    """Return the heading of a page."""
    match = _TITLE.search(source(name))
    return match[1] if match else name


@cache
def sections() -> dict[str, tuple[str, ...]]:
    """Return the pages of each section, by the name of the section's page; every page is in one section."""
    known = names()
    listed = {section: _LISTED.findall(source(section)) for section in _LISTED.findall(source(INDEX))}
    placed = {INDEX, *listed}
    for section, pages in listed.items():
        listed[section] = [key for key in dict.fromkeys(pages) if key in known and key not in placed]
        placed.update(listed[section])
    for name in known:
        if name not in placed:
            listed[_FOLDERS.get(name.split("/")[0], _ELSE)].append(name)
    return {section: tuple(pages) for section, pages in listed.items()}


class Section(NamedTuple):
    """A heading of a page with the text below it.

    `names` are the title, the heading and its synonyms; `phrases` the word stems of each synonym, and of the title at
    its own heading; `text` is its `source` without markup, in lower case.
    """

    page: str
    heading: str
    names: str
    phrases: frozenset[frozenset[str]]
    source: str
    text: str


def search(words: str) -> tuple[Section, ...]:
    """Return the best section of each page that contains some of the words or their stems, the best page first.

    A word has more weight the fewer pages contain it, and most in a heading. A section counts double if the words of
    one of its phrases were typed: among others for several words, as the only one for a single word. Decisions and
    pages that are lists have less weight. Pages far below the best are omitted.
    """
    stems = _stems(words)
    score = dict.fromkeys(_sections(), 0.0)
    for stem in dict.fromkeys(stems):
        begins = re.compile(rf"(?<![^\W_]){re.escape(stem)}" + r"(?!\w)" * (len(stem) == 1))
        weights = {
            section: 3 * _has(section.names, stem, begins) or _has(section.text, stem, begins) for section in score
        }
        pages = {section.page for section, weight in weights.items() if weight}
        rarity = math.log(1 + len(names()) / max(1, len(pages)))
        for section, weight in weights.items():
            score[section] += rarity * (weight or 0.25 * (section.page in pages))
    typed = frozenset(stems)
    for one in score:
        score[one] *= 2 if any(it == typed or (len(it) > 1 and it <= typed) for it in one.phrases) else 1
        score[one] *= 0.5 if one.page.split("/")[0] in _FOLDERS else 0.65 if one.page in _LISTS else 1
    best: dict[str, Section] = {}
    for one in sorted(score, key=lambda one: -score[one]):
        if score[one] > 0.3 * max(score.values()):
            best.setdefault(one.page, one)
    return tuple(best.values())


def _stems(words: str) -> list[str]:
    """Return the stems of the relevant words, or of all words if none is relevant."""
    typed, left_out = _WORD.findall(words.casefold()), _NO_MATTER.split()
    return [_ENDING.sub("", word) for word in typed if word not in left_out] or typed


def _has(text: str, stem: str, begins: re.Pattern[str]) -> bool:
    return stem in text and begins.search(text) is not None  # the first search alone takes a tenth of the time


def anchor_of(heading: str) -> str:
    """Return the anchor of a heading, as made by GitHub and MyST."""
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


def plain(text: str) -> str:
    """Return Markdown without its inline marks and the addresses of links."""
    return _MARKS.sub(lambda mark: mark[1] or "", text)


@cache
def synonyms() -> tuple[tuple[str, str, str], ...]:
    """Return page, anchor and words of each line of `_SYNONYMS`."""
    return tuple(_ROW.findall((folder() / _SYNONYMS).read_text(encoding="utf-8")))


def index_markdown() -> str:
    """Return the words of `_SYNONYMS` with links to their sections, as Markdown."""
    rows = sorted(synonyms(), key=lambda row: row[2].casefold())
    return "\n".join(f"- {said}: [{_heading(*place)}]({'.md#'.join(place).rstrip('#')})" for *place, said in rows)


def _heading(name: str, anchor: str) -> str:
    for read in (source, page):
        for match in _FENCED_OR_HEADING.finditer(read(name)):
            if match[1] and (not anchor or anchor_of(plain(match[1])) == anchor):
                return plain(match[1])
    raise KeyError(f"{name}#{anchor}")


@cache
def _sections() -> tuple[Section, ...]:
    """Return every section of every page, in the order of the book, with its synonyms."""
    made: list[Section] = []
    for name in (*(page for pages in sections().values() for page in pages), *sections(), INDEX):
        text, title_of_page = source(name) if name == _GLOSSARY else page(name), plain(title(name))
        headings = [match for match in _FENCED_OR_HEADING.finditer(text) if match[1]]
        for match, ends in zip(headings, [*(heading.start() for heading in headings[1:]), len(text)], strict=True):
            heading = plain(match[1])
            anchor = "" if heading == title_of_page else anchor_of(heading)
            also = [said for page_, anchor_, said in synonyms() if (page_, anchor_) == (name, anchor)]
            shown = " ".join([title_of_page, heading, *also]).casefold()
            said = ", ".join(also if anchor else [*also, title_of_page]).split(", ")
            phrases = frozenset(frozenset(_stems(phrase)) for phrase in said if phrase)
            below = text[match.end() : ends]
            made.append(
                Section(
                    page=name, heading=heading, names=shown, phrases=phrases, source=below, text=plain(below).casefold()
                )
            )
    return tuple(made)
