"""Commands that print evidence: accuracy, solver, soak, stability, timing."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from study_app.cli.options import echo_files, end_if

if TYPE_CHECKING:
    from study_app.evidence.table import Evidence


EXIT_UNDECIDED = 4


def present(found: "Evidence", to: Path | None, *, with_text: bool = True) -> None:
    """Print evidence and write it into a folder, if one was given.

    The exit code is 3 if a limit is missed, and 4 if one is undecided. ``with_text``: print the text in any case, not
    only where there is no folder.
    """
    if with_text or to is None:
        click.echo(found.text, nl=False)
    if to is not None:
        echo_files(found.write(to))
    if found.closing:
        click.echo(found.closing)
    end_if(found.missed)
    if found.undecided:
        click.get_current_context().exit(EXIT_UNDECIDED)
