"""What tests need of the operating system."""

import os

import pytest

needs_fork = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs processes that fork")
