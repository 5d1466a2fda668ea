"""The command that writes a study's report."""

from __future__ import annotations

from pathlib import Path

import click

from study_app.cli.options import EXIT_FOUND, Target, takes_study
from study_app.cli.progress import progress


@click.command()
@takes_study
@click.option("--to", type=Target(), required=True, metavar="DIR", help="Folder for the report.")
def report(results: Path, to: Path) -> None:
    """Write the report of a study: tests, figures, tables, conclusions and limitations, and how to reproduce it.

    Ends with exit code 3 if a section could not be computed: the report names it and contains everything else.
    """
    from study_app.analysis.report.write_report import report as write_report

    failed: list[str] = []
    with progress() as show:
        files = write_report(
            results, to, progress=show, warn=lambda words: click.echo(words, err=True), failed=failed.append
        )
    click.echo(f"{files[0]}  and {len(files) - 1} more files in its folder")
    for words in failed:
        click.echo(words, err=True)
    if failed:
        click.get_current_context().exit(EXIT_FOUND)
