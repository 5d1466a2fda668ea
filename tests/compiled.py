"""The marks of tests that run without the compiler (``NUMBA_DISABLE_JIT=1``, for debuggers and coverage)."""

import numba
import pytest

needs_servo = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="the servo and its devices exist compiled only")

wraps = pytest.mark.filterwarnings("ignore:overflow encountered in scalar multiply:RuntimeWarning")
"""For tests of functions whose unsigned integers wrap on purpose: NumPy warns of it where they run uncompiled."""
