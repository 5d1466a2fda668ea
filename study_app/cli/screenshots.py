"""The command that takes pictures of every window."""

import os
from pathlib import Path

import click

from study_app.cli.options import Target


@click.command()
@click.option("--to", type=Target(), required=True, metavar="DIR", help="Folder for the pictures.")
@click.option(
    "--only", type=click.Choice(("places", "designer", "session", "single-blind")), help="Only these; default: all."
)
def screenshots(to: Path, only: str | None) -> None:
    """Take pictures of every window of the program in both themes; takes some minutes and needs no display."""
    os.environ["QT_QPA_PLATFORM"] = "offscreen"  # the same pictures on every machine
    from study_app.app.screenshots import screenshots as take
    from study_app.store.output_files import make_folder

    make_folder(to)
    take(to, only=only, progress=click.echo)
