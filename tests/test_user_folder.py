"""The folder of the user's settings: the system's default, or that of a variable."""

import sys
from pathlib import Path

import pytest
from platformdirs.macos import MacOS
from platformdirs.unix import Unix

from study_app.user_folder import user_folder


def test_a_variable_points_elsewhere(monkeypatch, tmp_path):
    monkeypatch.setenv("LIQUID_STUDY_CONFIG", str(tmp_path / "mine"))
    assert user_folder() == tmp_path / "mine"
    assert not (tmp_path / "mine").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="asks the home folder as Unix does")
@pytest.mark.parametrize(
    ("system", "variable", "inside"),
    [(Unix, "XDG_CONFIG_HOME", "liquid-study"), (MacOS, "HOME", "Library/Application Support/liquid-study")],
)
def test_settings_are_where_the_system_keeps_them(monkeypatch, tmp_path, system, variable, inside):
    for name in ("LIQUID_STUDY_CONFIG", "XDG_CONFIG_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv(variable, str(tmp_path))
    monkeypatch.setattr("platformdirs.PlatformDirs", system)
    assert user_folder() == tmp_path / Path(inside)
