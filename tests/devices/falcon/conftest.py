import pytest


@pytest.fixture(autouse=True)
def own_settings(tmp_path, monkeypatch):
    """No calibration of this machine's user meets a test."""
    monkeypatch.setenv("LIQUID_STUDY_CONFIG", str(tmp_path / "settings"))
