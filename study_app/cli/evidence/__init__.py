"""Commands that print evidence: accuracy, solver, soak, stability, timing."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from study_app.cli.options import echo_files, end_if

if TYPE_CHECKING:
    from study_app.evidence.table import Evidence


def present(found: "Evidence", to: Path | None, *, with_text: bool = True) -> None:
    """Print evidence and write it into a folder, if one was given; end with 3 if a limit is missed.

    ``with_text``: print the text in any case, not only where there is no folder.
    """
    if with_text or to is None:
        click.echo(found.text, nl=False)
    if to is not None:
        echo_files(found.write(to))
    end_if(found.missed)
