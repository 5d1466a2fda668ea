"""Results as the values of JSON."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any, Final

from study_app.analysis.findings import all_findings
from study_app.analysis.results.block_results import BlockFound, Results
from study_app.analysis.results.level_results import LevelsFound
from study_app.analysis.tables.compared_blocks import Setting
from study_app.errors import AnalysisError

OF_FORMAT_2: Final = {
    Results: frozenset({"questions", "scores", "levels", "site_thresholds"}),
    LevelsFound: frozenset({"withheld"}),
    Setting: frozenset({"link", "view"}),
}
"""Results that reports of earlier versions do not have; omitted where there are none."""


def plain(value: Any) -> Any:
    """Return a result as JSON's objects, arrays, texts, numbers, true, false and null.

    Raises
    ------
    AnalysisError
        A number is NaN or infinite, which no result may be.
    """
    if isinstance(value, BlockFound):
        return {name: plain(entry) for name, entry in _entries(value)}
    if is_dataclass(value) and not isinstance(value, type):
        held = {field.name: getattr(value, field.name) for field in fields(value)}
        omitted = OF_FORMAT_2.get(type(value), frozenset())
        return {name: plain(entry) for name, entry in held.items() if entry or name not in omitted}
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, tuple | list):
        return [plain(entry) for entry in value]
    if hasattr(value, "item"):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        raise AnalysisError(f"a result is {value}: this is a fault of the program, please report it")
    return value


def _entries(found: BlockFound) -> Iterator[tuple[str, Any]]:
    """Yield a block's fields, the findings about settings in their midst and those about sessions last."""
    tested = [finding for finding in all_findings() if finding.what]
    for field in fields(found):
        if field.name != "findings":
            yield field.name, getattr(found, field.name)
            continue
        for finding in tested:
            if finding.about == "settings":
                yield from finding.entries(found).items()
    for finding in tested:
        if finding.about == "sessions":
            yield from finding.entries(found).items()
