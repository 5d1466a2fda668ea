"""Whose each comment of a text is, found in another way than the writer does."""

import re
from collections import Counter

from study_app.protocol.source.document import Path
from study_app.protocol.source.notation import Node, scan

_TOKENS = re.compile(
    r'"""(?:\\.|[^\\])*?"""(?!")'
    r"|'''.*?'''(?!')"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'"
    r"|(?P<comment>#[^\r\n]*)",
    re.DOTALL,
)
FREE: Path = ("(free)",)


def owners(text: str) -> Counter[tuple[Path, str]]:
    """Return the comments of a text with the path that each belongs to, `FREE` where it belongs to nothing."""
    nodes = scan(text)
    found: Counter[tuple[Path, str]] = Counter()
    for match in _TOKENS.finditer(text):
        if match["comment"]:
            found[_owner(text, nodes, match.start()), match["comment"].rstrip()] += 1
    return found


def _owner(text: str, nodes: tuple[Node, ...], at: int) -> Path:
    line = text.rfind("\n", 0, at) + 1
    if text[line:at].strip():
        ended = [node for node in nodes if line < node.end <= at]
        begun = [node for node in nodes if line <= node.start < at]
        return (
            max(ended, key=lambda node: node.end) if ended else begun[-1] if begun else Node("key", FREE, (), 0, 0, 0)
        ).path
    rest = text[at:].splitlines()
    if re.match(r"#\s*[-=*#~]{3,}", rest[0]):
        return FREE
    position = at
    for row in text[at:].splitlines(keepends=True):
        stripped = row.strip()
        if not stripped or re.match(r"#\s*[-=*#~]{3,}", stripped):
            return FREE
        if not stripped.startswith("#"):
            start = position + (len(row) - len(row.lstrip())) if position != at else at
            beginning = [node for node in nodes if node.start == start]
            return beginning[0].path if beginning else FREE
        position += len(row)
    return FREE
