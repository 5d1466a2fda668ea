"""The questions asked of the answers of a block: the subclasses of `Finding` in this folder's modules, and plug-ins."""

import sys
from typing import Any, Final

from study_app.analysis.findings.delays import ContrastsWithControl, DetectionThreshold, LowestDelay, common_ms
from study_app.analysis.findings.finding import FOUND, BlockAnswers, Finding, of_tables
from study_app.analysis.findings.recognition import LiquidRecognition, RecognitionResult, recognised
from study_app.analysis.findings.statement_tests import (
    DelayTrend,
    MeanTests,
    OverAll,
    Pairs,
    SettingsDiffer,
    with_gates,
)
from study_app.discovery import Registry, Returns, modules_of

__all__ = [
    "FINDINGS",
    "FOUND",
    "BlockAnswers",
    "ContrastsWithControl",
    "DelayTrend",
    "DetectionThreshold",
    "LiquidRecognition",
    "LowestDelay",
    "MeanTests",
    "OverAll",
    "Pairs",
    "RecognitionResult",
    "SettingsDiffer",
    "all_findings",
    "common_ms",
    "of_tables",
    "recognised",
    "with_gates",
]

_held = [var for module in modules_of(sys.modules[__name__]) for var in vars(module).values()]
_found = {one for one in _held if isinstance(one, type) and issubclass(one, Finding) and hasattr(one, "key")}
_RETURNS: Final = {
    "test": Returns(
        "a value and a tuple of what was not tested",
        lambda pair: isinstance(pair, tuple) and len(pair) == 2 and isinstance(pair[1], tuple),
    )
}
FINDINGS: Final = Registry[type[Finding[Any]]]("finding", {one.key: one for one in _found}, Finding, "key", _RETURNS)


def all_findings() -> tuple[type[Finding[Any]], ...]:
    """Return all kinds of findings, ordered by their places."""
    return tuple(sorted(FINDINGS.values(), key=lambda finding: finding.place))
