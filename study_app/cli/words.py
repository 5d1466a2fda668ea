"""The arguments, options and exit codes that commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

EXIT_USER_ERROR = 2
EXIT_FOUND = 3

FILE = click.argument("protocol", metavar="FILE")


class Target(click.Path):
    """A path to write to; an empty one, which would be the folder one is in, is refused."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path."""
        if not str(value):
            self.fail("is empty: name a file or folder, . for this one", param, ctx)
        return super().convert(value, param, ctx)


SESSION = click.argument("session", type=click.Path(path_type=Path))
RESULTS = click.option(
    "--results",
    type=Target(),
    metavar="DIR",
    help="Study folder; default results/<study>.",
)
