"""A study of two finished sessions."""

from pathlib import Path

import pytest

from tests.store.verification.played_studies import recorded


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """Two finished sessions: P007 with recordings and one repeated trial, and P008, who withdrew."""
    return recorded(tmp_path / "study")
