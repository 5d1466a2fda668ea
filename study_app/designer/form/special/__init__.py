"""Special editors: one module each, with a `SpecialEditor` named ``EDITOR``. The form works without any of them."""

import sys
from typing import Final

from study_app.designer.form import entries
from study_app.designer.form.special_editor import SpecialEditor
from study_app.discovery import modules_of

EDITORS: Final[dict[tuple[str, str], SpecialEditor]] = {
    key: module.EDITOR for module in (entries, *modules_of(sys.modules[__name__])) for key in module.EDITOR.keys
}
"""The special editor of each (model, key) that has one."""
