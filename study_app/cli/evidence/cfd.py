"""The command that sets models of a liquid beside a fluid solver."""

from __future__ import annotations

from pathlib import Path

import click

from study_app.cli.options import Target


@click.command()
@click.option(
    "--solve",
    is_flag=True,
    help="Solve the flow again instead of using the stored tables: some 5 minutes of one core, 15 on busy ones; needs "
    "the extra cfd (pip install ngsolve, 350 MB).",
)
@click.option("--to", type=Target(), metavar="DIR", help="Folder for tables and figure; else printed.")
def cfd(to: Path | None, *, solve: bool) -> None:
    """Fit models of honey and glycerin to the force that a fluid solver finds; say what stays wrong.

    A ball of 68 mm starts, moves evenly and stops at once, at 0.2 and 0.6 m/s. Fitting takes about a minute.
    """
    from study_app.store.output_files import make_folder
    from study_app.validation.cfd.fits import fit_all
    from study_app.validation.cfd.model_comparison import fits_markdown, steady_markdown, write
    from study_app.validation.cfd.solver import solve as solve_all
    from study_app.validation.cfd.stored_flows import steady, stored

    if solve and to is None:
        raise click.UsageError("--solve needs --to: the folder for the solver's tables")
    if to is not None:
        make_folder(to)
    for written in solve_all(to, lambda text: click.echo(text, err=True)) if solve and to is not None else ():
        click.echo(written)
    tables, drag = stored(to if solve else None), steady(to if solve else None)
    fits = fit_all(tables, lambda text: click.echo(text, err=True))
    if to is None:
        click.echo(f"{steady_markdown(drag)}\n\n{fits_markdown(fits)}")
        return
    for written in write(tables, drag, fits, to):
        click.echo(written)
