"""Run a program that kills others at random moments, and return what became of each of them."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any


def outcomes_of(killer: str, *arguments: object, limit_s: float = 150.0) -> list[dict[str, Any]]:
    """Run a module of this folder, ``killer`` or ``command_killer``; return its lines of JSON."""
    process = subprocess.run(
        [sys.executable, "-m", f"tests.faults.support.{killer}", *map(str, arguments)],
        cwd=Path(__file__).parents[3],
        capture_output=True,
        text=True,
        timeout=limit_s,
        check=False,
    )
    assert process.returncode == 0, process.stderr
    return [json.loads(line) for line in process.stdout.splitlines()]
