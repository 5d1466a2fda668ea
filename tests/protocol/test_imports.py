from __future__ import annotations

import pkgutil
import subprocess
import sys

import pytest

import study_app.protocol

HEAVY = ("numba", "llvmlite", "PySide6", "pyqtgraph", "pandas", "scipy", "matplotlib", "numpy")


@pytest.mark.slow
def test_reading_a_protocol_loads_neither_compiler_nor_qt():
    modules = [
        module.name for module in pkgutil.walk_packages(study_app.protocol.__path__, prefix="study_app.protocol.")
    ]
    assert "study_app.protocol.load" in modules
    program = (
        f"import sys, {', '.join(modules)}\n"
        "study_app.protocol.load.load('rek2024').scene_for('water')\n"
        f"print([name for name in {HEAVY} if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
