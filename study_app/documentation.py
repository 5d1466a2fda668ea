"""The pages of the documentation, without Qt and without Sphinx: the website and the window Help read them here.

A page is plain Markdown. A comment in it, ``<!-- generated: MODULE:FUNCTION -->``, stands for what that function
returns. The pages of a section are those that the section's own page links to in its lists; all others are in ``ELSE``.
"""

import re
from functools import cache
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from typing import Final

INDEX: Final = "index"
ELSE: Final = "do"
"""The section of pages that no section lists."""

FOLDERS: Final = {"decisions": "look-up"}
"""The section of pages in a folder that no section lists."""

_GENERATED: Final = re.compile(r"<!-- generated: ([\w.]+):(\w+) -->")
_LISTED: Final = re.compile(r"^- \[[^]]+\]\(([\w/-]+)\.md\)", re.MULTILINE)
_TITLE: Final = re.compile(r"^# (.+)$", re.MULTILINE)


def folder() -> Path:
    """Return the folder of the pages: of the installed package, or of the checkout that it runs from."""
    package = Path(str(files("study_app")))
    installed = package / "docs"
    return installed if installed.is_dir() else package.parent / "docs"


@cache
def names() -> tuple[str, ...]:
    """Return the name of every page, its path in the folder without the ending, sorted."""
    top = folder()
    found = (path.relative_to(top) for path in top.rglob("*.md"))
    return tuple(sorted(path.with_suffix("").as_posix() for path in found if path.parts[0] != "examples"))


def source(name: str) -> str:
    """Return the text of a page as it stands in its file."""
    return (folder() / f"{name}.md").read_text(encoding="utf-8")


def page(name: str) -> str:
    """Return a page as Markdown, with its generated parts."""
    return with_generated_parts(source(name))


def with_generated_parts(text: str) -> str:
    """Return the text of a page with the output of each function that it names in place of the comment."""
    return _GENERATED.sub(lambda found: getattr(import_module(found[1]), found[2])(), text)


def title(name: str) -> str:
    """Return the heading of a page."""
    found = _TITLE.search(source(name))
    return found[1] if found else name


@cache
def sections() -> dict[str, tuple[str, ...]]:
    """Return the pages of each section, by the name of the section's page; every page is in one section."""
    known = names()
    listed = {section: _LISTED.findall(source(section)) for section in _LISTED.findall(source(INDEX))}
    placed = {INDEX, *listed}
    for section, pages in listed.items():
        listed[section] = [one for one in dict.fromkeys(pages) if one in known and one not in placed]
        placed.update(listed[section])
    for name in known:
        if name not in placed:
            listed[FOLDERS.get(name.split("/")[0], ELSE)].append(name)
    return {section: tuple(pages) for section, pages in listed.items()}
