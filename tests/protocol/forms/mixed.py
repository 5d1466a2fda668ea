"""A small study of format 2 with a question of every kind, after trials and in forms."""

from pathlib import Path

from tests.protocol.edited_studies import text_of

MIXED = text_of("mixed")


def mixed_file(folder: Path, *edits: tuple[str, str]) -> Path:
    """Write the study with edits of its text, and return the file."""
    text = MIXED
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new, 1)
    path = folder / "mixed.toml"
    path.write_text(text, encoding="utf-8", newline="\n")
    return path
