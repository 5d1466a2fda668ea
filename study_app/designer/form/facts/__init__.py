"""What special editors show besides the value of their row: one module each, with a `RowFacts` named ``FACTS``."""

import sys
from typing import Final

from study_app.designer.form.row_facts import RowFacts
from study_app.discovery import modules_of

FACTS: Final[dict[tuple[str, str], RowFacts]] = {
    key: module.FACTS for module in modules_of(sys.modules[__name__]) for key in module.FACTS.keys
}
"""The facts of each (model, key) that has some."""
