"""Widgets are tested without a screen; where Qt cannot be loaded at all they are skipped, with the reason."""

import os
from pathlib import Path
from typing import NoReturn

import pytest

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

try:
    import PySide6.QtWidgets  # noqa: F401

    QT_MISSING = ""
except ImportError as missing:
    QT_MISSING = f"Qt cannot be loaded here: {missing}"


class UnloadableModule(pytest.Module):
    """A test module that cannot be imported without Qt."""

    def collect(self) -> NoReturn:
        pytest.skip(QT_MISSING, allow_module_level=True)


def pytest_pycollect_makemodule(module_path: Path, parent: pytest.Collector) -> pytest.Module | None:
    if QT_MISSING:
        return UnloadableModule.from_parent(parent, path=module_path)
    return None
