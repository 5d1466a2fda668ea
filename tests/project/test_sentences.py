"""Sentences for people: none has a pattern that readers of English stumble over."""

import ast
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SKIPPED = ("study_app/documentation.py",)
"""A list of single words."""
CODE = re.compile(r"`[^`]*`|“[^”]*”|\"[^\"]*\"|'[^']*'|\{[^{}]*\}|https?://\S+|\(`|--\w[\w-]*")
PLACE = re.compile(r"^(?:liquid-study|[\w.* ]*X[\w.*, X]*): ")
PATTERNS = {
    "two colons": re.compile(r"[\w)”%]: [^.;]*[\w)”%]: "),
    "is no, has no, gives no": re.compile(
        r"(?<!there )\b(?:is|are|was|were|has|have|had|gives?|holds?|contains?|finds?|names?|knows?|needs?) "
        r"(?:no|none|nothing)\b(?! (?:longer|more|effect|meaning|power|significant))",
        re.IGNORECASE,
    ),
    "that of, those of": re.compile(r"\b(?:is|are|be|as|from|with|of|to|in|than|by) (?:that|those) of\b"),
    "where for if": re.compile(r"\b(?:n/a|true|false|omitted|only|even|except|but|none|case) where\b", re.IGNORECASE),
    "from … on": re.compile(
        r"\bfrom [\w.]+ (?:[\w%]+ )?on\b(?! (?:the|a|an|your|this|one|both|which|its|screen|paper|disk)\b)"
    ),
    "left out": re.compile(r"\bleft out: |\bleave (?:it|them|this) out\b", re.IGNORECASE),
    "an id": re.compile(r"\b(?:an|the|this|its|participant) ids?\b"),
    "anew, besides, whoever": re.compile(r"\b(?:anew|whoever|whatever|besides)\b", re.IGNORECASE),
    "refuse": re.compile(r"\brefuse[sd]?\b"),
    "of one's own": re.compile(r"\bof (?:its|their|his) own\b"),
    "said of it": re.compile(r"\b(?:is|are) said\b|\bsuch as it is\b"),
    "give for specify": re.compile(r"(?:^|[:;,] |\bor )give\b(?! (?:its workers more|this account)\b)"),
    "another … than": re.compile(r"\b(?:an)?other \w+ (?:\([^)]*\) )?than\b"),
    "replace … by": re.compile(r"\breplace (?:[^.;:]+ )?by\b", re.IGNORECASE),
    "adjusted by Holm": re.compile(r"\bby (?:Holm|Benjamini)\b"),
    "comma for but": re.compile(r", this version (?:reads|knows)\b"),
    "small letters": re.compile(r"\bsmall letters?\b"),
}
FINE = {
    "module X has no attribute X": "is no, has no, gives no",  # Python's own sentence
    "`velocity_lag_s` is None, because the library filters.": "is no, has no, gives no",
    "warning: output created at X outside the workspace (X): X": "two colons",
    "the TCP connection is refused or times out": "refuse",  # the term of networks
}
OUT = {"compile", "match", "search", "sub", "findall", "split", "fullmatch", "setStyleSheet", "setObjectName", "debug"}


def text_of(node: ast.AST) -> str | None:
    """Return the text of a string, its values as X; None of other nodes."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(str(part.value) if isinstance(part, ast.Constant) else "X" for part in node.values)
    return None


def texts_in(node: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield line and text of the strings in a module that may be shown: neither docstrings nor patterns."""
    for child in ast.iter_child_nodes(node):
        called = child.func if isinstance(child, ast.Call) else None
        name = getattr(called, "attr", getattr(called, "id", ""))
        if name in OUT or (isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant)):
            continue
        if (text := text_of(child)) is not None:
            yield getattr(child, "lineno", 0), text
        if text is None or isinstance(child, ast.JoinedStr):
            values = child.values if isinstance(child, ast.JoinedStr) else ()
            inner = [part for part in values if not isinstance(part, ast.Constant)] or ([child] if text is None else [])
            for part in inner:
                yield from texts_in(part)


def values_of(value: object) -> Iterator[str]:
    """Yield each text in a document."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for part in value.values() if isinstance(value, dict) else value:
            yield from values_of(part)


def sentences() -> Iterator[tuple[str, str]]:
    """Yield place and text: strings of the program, its tables of failures and words, sentences of the docs."""
    for path in sorted((ROOT / "study_app").rglob("*.py")):
        place = path.relative_to(ROOT).as_posix()
        if not place.startswith(SKIPPED):
            for line, text in texts_in(ast.parse(path.read_text(encoding="utf-8"))):
                yield f"{place}:{line}", text
    for path in (*ROOT.glob("study_app/devices/*/failures.toml"), ROOT / "study_app/protocol/wording/en.toml"):
        for text in values_of(tomllib.loads(path.read_text(encoding="utf-8"))):
            yield path.name, text
    for path in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))):
        prose = re.sub(r"^```.*?^```|^    .*?$|<!--.*?-->|\]\([^)]*\)", "", path.read_text("utf-8"), flags=re.S | re.M)
        for paragraph in re.split(r"\n\s*\n|\n\s*(?:[-*]|\d+\.) |\n\s*\||\|", prose):
            for sentence in re.split(r"(?<=[.!?])\s+", " ".join(paragraph.split())):
                yield path.name, sentence


def found_in(text: str) -> list[str]:
    """Return the names of the patterns in a text, without its code, quotations and place."""
    plain = PLACE.sub("", CODE.sub("X", text))
    if len(plain.split()) < 3 or re.search(r"px;|</|\bfunction\b|^\s*#|\n", plain):
        return []
    return [
        name for name, pattern in PATTERNS.items() if pattern.search(plain) and FINE.get(" ".join(text.split())) != name
    ]


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("Force held back: at most 5 %: choose a smaller scale", "two colons"),
        ("the device has no button", "is no, has no, gives no"),
        ("its limit is that of the study", "that of, those of"),
        ("The level; n/a where it was not measured.", "where for if"),
        ("from 125 ms on at the latest", "from … on"),
        ("Use another id and leave it out", "left out"),
        ("the file is empty: give one with answers", "give for specify"),
        ("it has other statements than the first", "another … than"),
        ("replace the link by its target", "replace … by"),
        ("p is adjusted by Holm over the tests", "adjusted by Holm"),
        ("has format 3, this version reads 1 and 2", "comma for but"),
        ("two small letters, such as en", "small letters"),
    ],
)
def test_the_patterns_are_found(text: str, name: str) -> None:
    assert name in found_in(text)


def test_no_sentence_has_a_pattern_that_readers_stumble_over() -> None:
    assert {f"{place}: {text[:200]}": patterns for place, text in sentences() if (patterns := found_in(text))} == {}
