"""The workspace: the one folder of this machine that holds ``protocols/`` and ``results/``.

`LIQUID_STUDY_WORKSPACE` sets it for one run, else the user's settings do. Until it is chosen, it is the start folder
where that has both folders (a clone has), else `Liquid Study` in the user's documents.
"""

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from platformdirs import user_documents_path

from study_app.user_folder import settings_file

WORKSPACE_VARIABLE: Final = "LIQUID_STUDY_WORKSPACE"
FOLDER_NAME: Final = "Liquid Study"


@dataclass(frozen=True, slots=True)
class Workspace:
    """A folder for studies, liquid files and results; it need not exist yet."""

    folder: Path

    @property
    def protocols(self) -> Path:
        """The folder of the workspace's studies and liquid files."""
        return self.folder / "protocols"

    @property
    def results(self) -> Path:
        """The folder that contains the studies' results folders."""
        return self.folder / "results"

    def own_protocols(self) -> tuple[Path, ...]:
        """Return the files in ``protocols/``, sorted."""
        return tuple(sorted(self.protocols.glob("[!.]*.toml")))


def workspace() -> Workspace:
    """Return the workspace that was chosen, or the suggested one."""
    return chosen_workspace() or offered_workspace()


def chosen_workspace() -> Workspace | None:
    """Return the workspace of the environment or of the user's settings; None if none was chosen."""
    if folder := os.environ.get(WORKSPACE_VARIABLE) or _setting():
        return Workspace(Path(folder))
    return None


def offered_workspace() -> Workspace:
    """Return the workspace to suggest at the first start."""
    here = Workspace(Path.cwd())
    if here.protocols.is_dir() and here.results.is_dir():
        return here
    return Workspace(user_documents_path() / FOLDER_NAME)


def _setting() -> str | None:
    """Return the workspace in the settings file; None if the file is unusable (`store.workstation` reports it)."""
    try:
        document = json.loads(settings_file().read_bytes())
        folder = setting_of(document) if isinstance(document, dict) else None
        return folder if isinstance(folder, str) and os.fsencode(folder) and "\0" not in folder else None
    except (OSError, ValueError, RecursionError):
        return None


def setting_of(settings: Mapping[str, Any]) -> Any:
    """Return the workspace in a settings file; for an earlier one the folder above its ``results``."""
    earlier = settings.get("results")
    if "workspace" not in settings and isinstance(earlier, str) and Path(earlier).name == "results":
        return str(Path(earlier).absolute().parent)
    return settings.get("workspace")
