"""The program in its main window, on the display that is given: used by one user, then closed.

Run as a program: ``python -m tests.designer.support.program keys|mouse STUDY FOLDER``; it makes a study from the
empty one, saves it, plays it and keeps the pilot. It prints the number of actions.
"""

import os
import sys
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QSize
from PySide6.QtTest import QTest

from study_app.app.main_controller import run_home_window
from study_app.gui.application import application_here
from tests.designer.support.inputs import XInput
from tests.designer.support.made_studies import STUDIES, play, save
from tests.designer.support.users import USERS, User

SIZE = QSize(1366, 768)


def environment(folder: Path) -> dict[str, str]:
    """Return the environment of a program that has its workspace, settings and data in a folder."""
    own = {"WORKSPACE": folder, "DATA": folder / "data", "CONFIG": folder / "settings"}
    return os.environ | {f"LIQUID_STUDY_{name}": str(place) for name, place in own.items()}


def use(kind: str, act: Callable[[User], None]) -> User:
    """Open the main window and let a user act in it."""
    used: list[User] = []
    errors: list[BaseException] = []
    application_here()

    def begin(visit: object) -> None:
        window = visit.window  # type: ignore[attr-defined]  # the main window's controller
        window.resize(SIZE)
        window.move(0, 0)
        QTest.qWaitForWindowExposed(window)
        hand = XInput()
        hand.bring_forward(window)
        used.append(USERS[kind](window, hand))
        try:
            act(used[0])
        except BaseException as error:  # noqa: BLE001 - raised below, once the window is closed
            errors.append(error)
        window.close()
        visit.loop.quit()  # type: ignore[attr-defined]
        visit.loop.exec = lambda: 0  # type: ignore[attr-defined]  # it is over

    run_home_window(then=begin)
    if errors:
        raise errors[0]
    return used[0]


def main(kind: str, study: str, folder: Path) -> None:
    """Make a study, save it and play it."""

    def act(user: User) -> None:
        STUDIES[study](user)
        save(user, folder / "protocols" / f"{study}.toml")
        play(user)

    sys.stdout.write(f"{use(kind, act).actions}\n")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], Path(sys.argv[3]))
