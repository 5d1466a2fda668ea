"""Where the user's settings of this program are: calibrations, and what this machine is like; apart from results."""

import os
from pathlib import Path
from typing import Final

from platformdirs import user_config_path, user_data_path

FOLDER_VARIABLE: Final = "LIQUID_STUDY_CONFIG"
_DATA_VARIABLE: Final = "LIQUID_STUDY_DATA"
_SETTINGS_NAME: Final = "machine.json"


def user_folder() -> Path:
    """Return the folder of the user's settings of this program, which need not exist yet."""
    if own := os.environ.get(FOLDER_VARIABLE):
        return Path(own)
    return user_config_path("liquid-study", appauthor=False, roaming=True)


def data_folder() -> Path:
    """Return the folder of drafts and earlier contents of studies, which need not exist yet."""
    if own := os.environ.get(_DATA_VARIABLE):
        return Path(own)
    return user_data_path("liquid-study", appauthor=False)


def settings_file() -> Path:
    """Return the settings file of this machine, which need not exist yet."""
    return user_folder() / _SETTINGS_NAME
