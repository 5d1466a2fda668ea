"""The commands that measure the accuracy of the force model, and compare it with flows."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from study_app.cli.evidence import present
from study_app.cli.options import Target, echo_files, exclude_each_other, executor_for, prepare, progress, takes_workers
from study_app.workers.executors import Workers

if TYPE_CHECKING:
    from study_app.haptics.model.motion import Motion
    from study_app.haptics.model.scene import Scene

DEFAULT_PATH = "stir"
REAL = "physical2"


@click.command()
@click.argument("scene", metavar="[FILE]", required=False)
@click.option("--liquid", metavar="NAME", help="Name of the liquid; default: water of rek2024, and honey of physical2.")
@click.option(
    "--path",
    default=DEFAULT_PATH,
    show_default=True,
    metavar="PATH",
    help="Motion CSV, or a programmed path: stir, circle, reverse, reach …",
)
@click.option(
    "--liquids",
    "every",
    is_flag=True,
    help="Compare the liquids of FILE (default: physical2) instead, each with its own model: error of the force, up to "
    "which speed, and computation time of a tick.",
)
@click.option("--to", type=Target(), metavar="DIR", help="Folder for table and figure; default: print.")
def accuracy(scene: str | None, liquid: str | None, path: str, to: Path | None, *, every: bool) -> None:
    """Compare accuracy and computation time of the models of a liquid.

    FILE is a protocol or scene file; default: rek2024 and physical2.
    Wakes are compared with their definition, models of a real liquid with experiments, exact solutions and a solver.
    """
    if every:
        exclude_each_other(liquids=every, liquid=liquid)
        exclude_each_other(liquids=every, path=None if path == DEFAULT_PATH else path)
        _survey(scene, to)
        return
    from study_app.evidence.accuracy.accuracy_report import evidence
    from study_app.evidence.accuracy.comparison import accuracy as measure

    numerical, physical, notes = _subjects(scene, liquid)
    one = numerical or physical
    motion = motion_along(path, one) if one is not None else None
    if motion is None:
        raise click.UsageError(f"nothing can be measured: {'; '.join(notes)}")
    prepare(to)
    named = "stirring" if path == DEFAULT_PATH else path
    with progress(lambda text: click.echo(f"{text} …", err=True)) as show:
        found = measure(numerical, physical, motion, named=named, notes=notes, progress=show)
    present(evidence(found), to, with_text=False)


def _survey(file: str | None, to: Path | None) -> None:
    """Print or write the error of the force of every liquid of a file."""
    from study_app.evidence.accuracy.survey import evidence, survey
    from study_app.protocol.load import load_scenes

    prepare(to)
    with progress(lambda text: click.echo(f"{text} …", err=True)) as show:
        found = survey(load_scenes(file or REAL), show)
    if not found:
        raise click.UsageError(f"{file}: no liquid has a viscosity, so there is no physical reference to compare with")
    present(evidence(found), to, with_text=False)


def _subjects(scene: str | None, liquid: str | None) -> tuple[Scene | None, Scene | None, tuple[str, ...]]:
    """Return the scene whose definition is followed, the one whose liquid is real, and what is missing."""
    from study_app.protocol.load import load_scene, load_scenes

    if scene is None and liquid is None:
        return load_scene("rek2024", "water"), load_scene(REAL, "honey"), ()
    if scene is None:
        thesis, real = load_scenes("rek2024"), load_scenes(REAL)
        if liquid in thesis or liquid in real:
            return thesis.get(liquid or ""), real.get(liquid or ""), ()
        known = ", ".join(dict.fromkeys([*thesis, *real]))
        raise click.UsageError(f"--liquid {liquid}: there are {known}; or give FILE, which has it")
    if liquid is None:
        there = load_scenes(scene)
        if len(there) > 1:
            raise click.UsageError(f"{scene}: say which --liquid of {', '.join(there)}")
        liquid = next(iter(there))
    chosen = load_scene(scene, liquid)
    if chosen.liquids[0].viscosity_pa_s is None:
        return chosen, None, (f"{liquid} has no viscosity, so there is no physical reference to compare with",)
    if chosen.liquids[0].drag.law == "linear":
        return chosen, None, (f"{liquid} is a linear damper, so there is no physical reference to compare with",)
    return chosen, chosen, ()


def motion_along(path: str, scene: Scene) -> Motion:
    """Return the motion of a path's name or a motion file, at the scene's rate."""
    from study_app.evidence.reference_solutions import stir
    from study_app.haptics.model import motion
    from study_app.lab.identify.measured_force import at_rate

    if path == DEFAULT_PATH:
        return stir(scene.scale, scene.rate_hz)
    programmed = path in motion.NAMES or not (Path(path).suffix or Path(path).exists())
    return motion.path(path, rate_hz=scene.rate_hz) if programmed else at_rate(motion.read(Path(path)), scene.rate_hz)


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
@click.option(
    "--score",
    is_flag=True,
    help="Score the models by the benchmark that other engines can enter: error, time, energy given, delay borne; "
    "takes about five minutes.",
)
@takes_workers
def cfd(to: Path | None, workers: Workers, *, solve: bool, refit: bool, materials: bool, score: bool) -> None:
    """Fit models of honey and glycerin to the force of a fluid solver; report the remaining error.

    A ball of 68 mm starts, moves at constant speed and stops abruptly, at 0.2 and 0.6 m/s. Fitting takes about a
    minute. Further motions, such as oscillations and a reversal, are used by --refit.
    """
    from study_app.evidence.cfd import fits, law_fit
    from study_app.evidence.cfd.solver import solve as solve_all
    from study_app.evidence.cfd.stored_flows import held_out, steady, stored, training

    exclude_each_other(refit=refit, materials=materials, score=score)
    exclude_each_other(solve=solve, score=score)
    if solve and to is None:
        raise click.UsageError("--solve needs --to: the folder for the solver's tables")
    prepare(to)
    if score:
        with progress(lambda text: click.echo(text, err=True)) as show:
            scored = fits.score_all(show)
        present(scored, to)
        return
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
        if refit:
            found = law_fit.evidence(law_fit.refit((*tables, *training(source)), held_out(source), show))
        else:
            found = fits.evidence(tables, drag, fits.fit_all(tables, show))
    echo_files(solved)
    present(found, to, with_text=False)


def _materials(to: Path | None, workers: Workers, *, solve: bool) -> None:
    """Print or write the law's error in Herschel–Bulkley liquids, with the stored table or a new one."""
    from study_app.evidence.cfd.yield_flow import evidence, solve_materials, stored_materials

    if solve and to is not None:
        with progress(lambda text: click.echo(text, err=True)) as show, executor_for(workers) as executor:
            click.echo(solve_materials(to, executor, show))
    present(evidence(stored_materials(to if solve else None)), to, with_text=False)
