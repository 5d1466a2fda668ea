"""The command that compares models of a liquid with a fluid solver."""

from pathlib import Path

import click

from study_app.cli.options import Target, exclude_each_other
from study_app.cli.parallel import executor_for, takes_workers
from study_app.cli.progress import progress
from study_app.workers.executors import Workers


@click.command()
@click.option(
    "--solve",
    is_flag=True,
    help="Solve the flow again instead of using the stored tables: 20 minutes on one core, an hour on a busy one; "
    "needs the extra cfd (NGSolve, 350 MB).",
)
@click.option(
    "--refit",
    is_flag=True,
    help="Fit the constants of unsteady drag to the stored motions, and print the error for each motion, with and "
    "without this motion in the fit; takes about two minutes.",
)
@click.option("--to", type=Target(), metavar="DIR", help="Folder for tables and figure; default: print.")
@click.option(
    "--materials",
    is_flag=True,
    help="Only compare the drag in Herschel–Bulkley liquids; with --solve this takes half an hour.",
)
@takes_workers
def cfd(to: Path | None, workers: Workers, *, solve: bool, refit: bool, materials: bool) -> None:
    """Fit models of honey and glycerin to the force of a fluid solver; report the remaining error.

    A ball of 68 mm starts, moves at constant speed and stops abruptly, at 0.2 and 0.6 m/s. Fitting takes about a
    minute. Further motions, such as oscillations and a reversal, are used by --refit.
    """
    from study_app.store.output_files import make_folder
    from study_app.validation.cfd.fits import fit_all
    from study_app.validation.cfd.law_fit import refit as refit_all
    from study_app.validation.cfd.law_fit import refit_markdown, write_refit
    from study_app.validation.cfd.model_comparison import fits_markdown, steady_markdown, write
    from study_app.validation.cfd.solver import solve as solve_all
    from study_app.validation.cfd.stored_flows import held_out, steady, stored, training

    exclude_each_other(refit=refit, materials=materials)
    if solve and to is None:
        raise click.UsageError("--solve needs --to: the folder for the solver's tables")
    if to is not None:
        make_folder(to)
    if materials:
        _materials(to, workers, solve=solve)
        return
    with progress(lambda text: click.echo(text, err=True)) as show:
        solved: tuple[Path, ...] = ()
        if solve and to is not None:
            with executor_for(workers) as executor:
                solved = solve_all(to, executor, show)
        source = to if solve else None
        tables, drag = stored(source), steady(source)
        found = refit_all((*tables, *training(source)), held_out(source), show) if refit else None
        fits = fit_all(tables, show) if found is None else ()
    for written in solved:
        click.echo(written)
    if found is not None and to is None:
        click.echo(refit_markdown(found))
        return
    if found is not None and to is not None:
        for written in write_refit(found, to):
            click.echo(written)
        return
    if to is None:
        click.echo(f"{steady_markdown(drag)}\n\n{fits_markdown(fits)}")
        return
    for written in write(tables, drag, fits, to):
        click.echo(written)


def _materials(to: Path | None, workers: Workers, *, solve: bool) -> None:
    """Print or write the law's error in Herschel–Bulkley liquids, with the stored table or a new one."""
    from study_app.validation.cfd.yield_flow import (
        materials_markdown,
        solve_materials,
        stored_materials,
        write_materials,
    )

    if solve and to is not None:
        with progress(lambda text: click.echo(text, err=True)) as show, executor_for(workers) as executor:
            click.echo(solve_materials(to, executor, show))
    columns = stored_materials(to if solve else None)
    click.echo(materials_markdown(columns) if to is None else write_materials(columns, to))
