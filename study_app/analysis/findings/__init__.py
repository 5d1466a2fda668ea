"""The questions asked of the answers of a block: one module per finding, described by its ``FINDING``.

Modules of folders in this one, such as ``factors``, are findings, too.
"""

import sys
from functools import cache
from typing import Any

from study_app.analysis.results.finding import Finding
from study_app.discovery import modules_of


@cache
def all_findings() -> tuple[Finding[Any], ...]:
    """Return the ``FINDING`` of every module of this folder, in the order of their places."""
    here = list(modules_of(sys.modules[__name__]))
    modules = [inner for one in here for inner in (modules_of(one) if hasattr(one, "__path__") else [one])]
    return tuple(sorted((module.FINDING for module in modules), key=lambda finding: finding.place))
