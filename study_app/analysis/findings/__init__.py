"""The questions asked of the answers of a block: every subclass of `Finding` in a module of this folder."""

import sys
from functools import cache
from typing import Any

from study_app.analysis.findings.finding import Finding
from study_app.discovery import modules_of


@cache
def all_findings() -> tuple[type[Finding[Any]], ...]:
    """Return every finding of the modules of this folder, in the order of their places."""
    held = [one for module in modules_of(sys.modules[__name__]) for one in vars(module).values()]
    found = {one for one in held if isinstance(one, type) and issubclass(one, Finding) and hasattr(one, "key")}
    return tuple(sorted(found, key=lambda finding: finding.place))
