"""What meets in the composition root is tested without a screen, as the windows are."""

from tests.gui.conftest import pytest_pycollect_makemodule

__all__ = ["pytest_pycollect_makemodule"]
