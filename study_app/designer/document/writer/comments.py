"""Comments of a TOML text."""

import re
from typing import Final, NamedTuple

_PIECES: Final = re.compile(
    r'"""(?:\\.|[^\\])*?"""(?!")'
    r"|'''.*?'''(?!')"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'"
    r"|(?P<comment>#[^\r\n]*)",
    re.DOTALL,
)
"""Strings, in which a # begins no comment, and comments."""


class Comment(NamedTuple):
    """A comment: its line, from 1, and its text with the #."""

    line: int
    text: str


def comments_naming(text: str, name: str) -> tuple[Comment, ...]:
    """Return the comments that mention a name as a whole word.

    A name of letters alone may be a common word, so it counts only in quotes, after "[" or ".", or as a key before "=".
    """
    plain = re.escape(name)
    as_code = rf"([`\"']){plain}\1|(?<=[\[.]){plain}(?![\w-])|(?<![\w.-]){plain}\s*="
    word = re.compile(as_code if name.isalpha() else rf"(?<![\w-]){plain}(?![\w-])")
    return tuple(
        Comment(text.count("\n", 0, found.start()) + 1, found["comment"].rstrip())
        for found in _PIECES.finditer(text)
        if found["comment"] and word.search(found["comment"])
    )
