"""The texts of figures of matplotlib, for golden files."""

import re
from collections.abc import Iterator
from typing import Any

from matplotlib.text import Text


def stub_png(figure: Any, *_form: object) -> bytes:
    """Return a file that begins as every PNG does, and then holds the licence of a figure."""
    size = [round(inches * 300).to_bytes(4, "big") for inches in figure.get_size_inches()]
    texts = [" / ".join(text.get_text().split("\n")) for text in figure.findobj(Text) if text.get_visible()]
    return b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR" + b"".join(size) + "\n".join(texts).encode()


def figure_words(content: bytes) -> Iterator[str]:
    """Yield the licence of a figure in a file of `stub_png` that have words."""
    yield from (text for text in content[24:].decode().split("\n") if re.search(r"[^\W\d_]{2}", text))
