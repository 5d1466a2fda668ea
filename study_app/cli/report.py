"""The command that writes a study's report."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from study_app.cli.options import EXIT_FOUND, Target, takes_study


@click.command()
@takes_study
@click.option("--to", type=Target(), required=True, metavar="DIR", help="Where the report goes.")
def report(results: Path, to: Path) -> None:
    """Write the report of a study: tests, figures, tables, what can be said and what cannot, and how to repeat it.

    Ends with exit code 3 where a section could not be computed: the report names it, and holds everything else.
    """
    from study_app.analysis.report.write_report import report as write_report

    line = _Line()
    failed: list[str] = []
    try:
        files = write_report(
            results, to, progress=line, warn=lambda words: click.echo(words, err=True), failed=failed.append
        )
    finally:
        line.clear()
    click.echo(f"{files[0]}  and {len(files) - 1} files beside it")
    for words in failed:
        click.echo(words, err=True)
    if failed:
        click.get_current_context().exit(EXIT_FOUND)


class _Line:
    """One line of progress on a terminal, written over again and again; on anything else nothing."""

    def __init__(self) -> None:
        self._shown = sys.stderr.isatty()

    def __call__(self, what: str, share: float) -> None:
        if self._shown:
            click.echo(f"\r\033[K{share:4.0%}  {what}", err=True, nl=False)

    def clear(self) -> None:
        """Take the line away."""
        if self._shown:
            click.echo("\r\033[K", err=True, nl=False)
