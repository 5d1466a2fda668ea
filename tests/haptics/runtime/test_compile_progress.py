"""Compilation reports its progress, and nothing if all functions are in the cache."""

import os
import subprocess
import sys
from pathlib import Path

import numba
import pytest

from study_app.haptics.kernels.compiled import EXPECTED, following_compilation
from study_app.haptics.runtime.pack import pack
from study_app.protocol.load import load_scene
from tests.compiled import needs_servo

pytestmark = needs_servo

ROOT = Path(__file__).parents[3]
OPENED = """
from random import Random
from study_app.devices.rig import open_rig, study_settings
from study_app.haptics.kernels.compiled import following_compilation
from study_app.protocol.load import load

shares = []
with following_compilation(shares.append) as counter:
    open_rig("scripted", study_settings(load("demo"), Random(1))).stop()
assert shares == sorted(shares)
print(counter.compiled)
"""


def test_compiled_functions_are_counted_but_not_cached_ones() -> None:
    @numba.njit  # not stored on the disk, where a second run would find it
    def inner(x):
        return x + 1

    @numba.njit
    def outer(x):
        return inner(x) * 2

    shares: list[float] = []
    with following_compilation(shares.append) as counter:
        assert outer(3) == 8
        assert outer(4) == 10
    assert counter.compiled == 2
    assert shares == [1 / EXPECTED, 2 / EXPECTED]
    with following_compilation(shares.append):
        outer(5)
    assert len(shares) == 2


def test_the_types_of_a_model_have_the_names_by_which_they_are_pickled() -> None:
    """Cached code is found by its argument types; a type that is pickled by value differs in each process."""
    model = pack(load_scene("demo", "thick"))
    for kind in (type(model), type(model.rows)):
        assert getattr(sys.modules[kind.__module__], kind.__qualname__, None) is kind


@pytest.mark.nightly
def test_the_first_session_compiles_the_expected_share_and_the_second_nothing(tmp_path: Path) -> None:
    command = [sys.executable, "-c", OPENED]
    own = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "NUMBA_CPU_NAME": "generic"}
    first, second = (
        int(subprocess.run(command, env=own, cwd=ROOT, capture_output=True, text=True, check=True).stdout) for _ in "12"
    )
    assert 0.85 * EXPECTED <= first <= 1.1 * EXPECTED
    assert second == 0
