"""What Sphinx adds to the pages: generated parts, tables of contents from their links, the Python interface."""

from __future__ import annotations

from typing import Any

from sphinx.application import Sphinx

from study_app.documentation import INDEX, sections, synonyms, with_generated_parts

API = "<!-- sphinx: api -->"
MODULES = ("study_app.api", "study_app.haptics.model.scene", "study_app.devices.base", "study_app.devices.descriptor")


def complete(_app: Sphinx, name: str, text: list[str]) -> None:
    """Put generated parts into a page, its synonyms into the index, below a page that lists others their contents."""
    text[0] = with_generated_parts(text[0]).replace(API, _api())
    words = [word for page, _anchor, said in synonyms() if page == name for word in said.split(", ")]
    if words:
        heading, _, rest = text[0].partition("\n")
        entries = "".join(f"   single: {word}\n" for word in words)
        text[0] = f"{heading}\n\n```{{eval-rst}}\n.. index::\n{entries}```\n{rest}"
    contents = sections()
    below = tuple(contents) if name == INDEX else contents.get(name, ())
    if below:
        text[0] += "\n".join(("", "```{toctree}", ":hidden:", "", *(f"/{page}" for page in below), "```", ""))


def _api() -> str:
    parts = (f"## {module}\n\n```{{eval-rst}}\n.. automodule:: {module}\n   :members:\n```\n" for module in MODULES)
    return "\n".join(parts)


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect to Sphinx."""
    app.connect("source-read", complete)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
