"""All pictures, one after the other."""

import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import chdir, contextmanager
from pathlib import Path
from typing import Final

from PySide6.QtCore import QtMsgType, qInstallMessageHandler

from study_app.app.timing import collecting_in_this_thread
from study_app.gui.application import application_here
from study_app.gui.theme.theme import DARK, LIGHT
from study_app.user_folder import FOLDER_VARIABLE
from study_app.workspace import FOLDER_NAME, WORKSPACE_VARIABLE
from tools.screenshots.capture import Camera
from tools.screenshots.designer_pictures import take_designer, write_studies
from tools.screenshots.example_study import STUDY, quick, recorded, rehearsed
from tools.screenshots.main_views import take_places
from tools.screenshots.session_pictures import take_session, take_single_blind

GROUPS: Final = ("places", "designer", "session", "single-blind")


def screenshots(
    to: Path,
    *,
    only: str | None = None,
    sizes: tuple[tuple[int, int], ...] = (),
    progress: Callable[[str], object] = print,
) -> tuple[Path, ...]:
    """Take pictures of every window in both themes into the folder ``to``; return the files.

    Parameters
    ----------
    to : must exist
    only : one of `GROUPS`, by default all
    sizes : width and height [px] in which every window that is no dialog is taken, too
    progress : is given a line for every picture

    Raises
    ------
    StudyError
        A window did not show what was waited for.
    StoreError
        A picture cannot be written.
    """
    qInstallMessageHandler(_pass_on)
    application_here()
    camera = Camera(to.resolve(), progress, sizes)
    with (
        tempfile.TemporaryDirectory(prefix="liquid-study-") as held,
        _at_home_in(Path(held)),
        collecting_in_this_thread(),
    ):
        if only in (None, "places"):
            results = rehearsed(Path(FOLDER_NAME))
            recorded()
            for theme in (LIGHT, DARK):
                take_places(camera, results, theme)
        if only in (None, "designer"):
            write_studies(Path(FOLDER_NAME, "protocols"))
            for theme in (LIGHT, DARK):
                take_designer(camera, Path(FOLDER_NAME, "results"), theme)
        if only in (None, "session"):
            take_session(camera, quick(Path()), Path("held", STUDY))
        if only in (None, "single-blind"):
            take_single_blind(camera, quick(Path(), blinding="single"), Path("seen", STUDY))
    return tuple(camera.taken)


@contextmanager
def _at_home_in(folder: Path) -> Iterator[None]:
    """Let the program keep its settings in ``folder`` and begin from there, so that no picture names a place."""
    settings = _environment(FOLDER_VARIABLE, str(folder / "settings"))
    with settings, _environment(WORKSPACE_VARIABLE, FOLDER_NAME), chdir(folder):
        yield


@contextmanager
def _environment(name: str, value: str) -> Iterator[None]:
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before


def _pass_on(kind: QtMsgType, _context: object, message: str) -> None:
    """Print Qt's messages, except those about a missing screen."""
    if kind != QtMsgType.QtDebugMsg and not message.startswith("This plugin does not support"):
        sys.stderr.write(f"{message}\n")
