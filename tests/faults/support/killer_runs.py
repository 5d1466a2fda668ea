"""Run a program that kills others at random moments, and return what became of each of them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

needs_fork = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs processes that fork")


def outcomes_of(killer: str, *arguments: object) -> list[dict[str, Any]]:
    """Run a module of this folder, ``killer`` or ``command_killer``; return its lines of JSON."""
    done = subprocess.run(
        [sys.executable, "-m", f"tests.faults.support.{killer}", *map(str, arguments)],
        cwd=Path(__file__).parents[3],
        capture_output=True,
        text=True,
        timeout=150,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]
