"""The findings about a block's answers: the subclasses of `Finding` in this folder's modules, and plug-ins."""

import sys
from typing import Any, Final

from study_app.analysis.findings.delays import ContrastsWithControl, DetectionThreshold, LowestDelay, common_ms
from study_app.analysis.findings.finding import FOUND, BlockAnswers, Finding, answers_from_tables
from study_app.analysis.findings.recognition import LiquidRecognition, RecognitionResult, recognised
from study_app.analysis.findings.statement_tests import DelayTrend, MeanTests, OverAll, Pairs, SettingsDiffer, add_gates
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
    "add_gates",
    "all_findings",
    "answers_from_tables",
    "common_ms",
    "recognised",
]

_variables = [var for module in modules_of(sys.modules[__name__]) for var in vars(module).values()]
_classes = {var for var in _variables if isinstance(var, type) and issubclass(var, Finding) and hasattr(var, "key")}
_RETURNS: Final = {
    "test": Returns(
        "a value and a tuple of what was not tested",
        lambda pair: isinstance(pair, tuple) and len(pair) == 2 and isinstance(pair[1], tuple),
    )
}
FINDINGS: Final = Registry[type[Finding[Any]]](
    "finding", {finding.key: finding for finding in _classes}, Finding, "key", _RETURNS
)


def all_findings() -> tuple[type[Finding[Any]], ...]:
    """Return all kinds of findings, ordered by their places."""
    return tuple(sorted(FINDINGS.values(), key=lambda finding: finding.place))
