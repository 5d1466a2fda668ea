"""What format 2 describes and this version does not support yet: each value is a fault of its own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from study_app.protocol.source.document import entries
from study_app.protocol.source.problems import Fault

METHODS: Final = ("adjustment",)
DESIGNS: Final = ("adjustment",)
METHOD: Final = 'method = "questplus"'


def not_supported(document: Mapping[str, Any]) -> Iterator[Fault]:
    """Yield a fault for every kind of a later version."""
    for section, key, kinds in (("methods", "method", METHODS), ("designs", "design", DESIGNS)):
        hint = METHOD if section == "methods" else "another design"
        tables = document.get(section, {})
        for path, kind in entries(document, f"{section}.*.kind"):
            if kind in kinds:
                yield Fault(path, f'"{kind}" is not supported yet', hint.replace("method", "kind"))
        for path, name in entries(document, f"blocks.*.{key}"):
            if name in kinds and name not in tables:
                yield Fault(path, f'"{name}" is not supported yet', hint)
