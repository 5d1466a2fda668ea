"""The questions asked of the answers of a block: the subclasses of `Finding` in this folder's modules, and plug-ins."""

import sys
from typing import Any, Final

from study_app.analysis.findings.finding import Finding
from study_app.discovery import Registry, modules_of

_held = [one for module in modules_of(sys.modules[__name__]) for one in vars(module).values()]
_found = {one for one in _held if isinstance(one, type) and issubclass(one, Finding) and hasattr(one, "key")}
FINDINGS: Final = Registry[type[Finding[Any]]]("finding", {one.key: one for one in _found}, Finding, "key")


def all_findings() -> tuple[type[Finding[Any]], ...]:
    """Return every finding, in the order of their places."""
    return tuple(sorted(FINDINGS.values(), key=lambda finding: finding.place))
