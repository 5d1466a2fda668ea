"""The arguments, options and exit codes that commands share."""

from __future__ import annotations

from pathlib import Path

import click

EXIT_USER_ERROR = 2
EXIT_FOUND = 3

FILE = click.argument("protocol", metavar="FILE")
SESSION = click.argument("session", type=click.Path(path_type=Path))
RESULTS = click.option(
    "--results",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Study folder; default results/<study>.",
)
