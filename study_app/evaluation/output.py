"""Where reports go."""

from __future__ import annotations

from pathlib import Path

from study_app.errors import StoreError


def make_folder(to: Path) -> None:
    """Make the folder for reports before the work begins, not minutes or days after.

    Raises
    ------
    StoreError
        It cannot be made.
    """
    try:
        to.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(
            f"cannot make the folder {to} ({error.strerror or error}): choose another with --to"
        ) from error
