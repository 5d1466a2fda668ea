"""The commands about the force model alone."""

from pathlib import Path

import click

from study_app.cli.options import SCENE_FILE, Target
from study_app.haptics.model.device_dynamics import BELIEVED_TICKS, MOST_DELAY


@click.command()
@SCENE_FILE
@click.option("--liquid", required=True, metavar="NAME", help="Id of the liquid in that file.")
@click.option("--path", required=True, metavar="PATH", help="Motion CSV, or a programmed path: circle, line, stop …")
@click.option("--to", required=True, type=Target(), metavar="CSV", help="File to write.")
@click.option("--set", "changes", multiple=True, metavar="NAME=VALUE", help="Override a parameter; repeatable.")
def simulate(scene: str, liquid: str, path: str, to: Path, changes: tuple[str, ...]) -> None:
    """Compute the force along a motion, with the servo's own tick, without a device or a clock.

    Every row of the motion is one tick: give rows at the scene's rate (1 kHz unless its rate_hz differs).
    """
    from study_app.haptics.model import motion, paths
    from study_app.haptics.model.overrides import override_all
    from study_app.haptics.runtime import offline
    from study_app.protocol.load import load_scene
    from study_app.store.tables import csv_files

    chosen = override_all(load_scene(scene, liquid), dict(assignment(change) for change in changes))
    programmed = path in paths.NAMES or not (Path(path).suffix or Path(path).exists())
    moved = paths.path(path, rate_hz=chosen.rate_hz) if programmed else motion.read(Path(path))
    table = offline.simulate(chosen, moved)
    csv_files.write_columns(to, table)
    click.echo(f"{to}: {len(table)} rows")


def assignment(change: str) -> tuple[str, str]:
    """Return name and value of a --set."""
    name, separator, value = change.partition("=")
    if not separator:
        raise click.UsageError(f"--set {change}: write NAME=VALUE, such as --set density_kg_m3=1200")
    return name.strip(), value.strip()


@click.command()
@SCENE_FILE
@click.option("--liquid", metavar="NAME", help="Only this liquid; default: every liquid of the file.")
@click.option(
    "--delay",
    type=click.IntRange(0, MOST_DELAY),
    default=BELIEVED_TICKS,
    show_default=True,
    metavar="TICKS",
    help="The device's delay, for the expected error.",
)
def scene(scene: str, liquid: str | None, delay: int) -> None:
    """Print the effects that a scene needs and why, the measured cost of each, and the expected force error."""
    from study_app.evaluation.cost import report
    from study_app.evaluation.expected_error import error_report
    from study_app.protocol.load import load_scene, load_scenes

    chosen = [load_scene(scene, liquid)] if liquid else list(load_scenes(scene).values())
    click.echo("\n\n".join(f"{report(one)}\n{error_report(one, delay)}" for one in chosen))


@click.command()
@click.option("--to", required=True, type=Target(), metavar="DIR", help="Folder to write into.")
def figures(to: Path) -> None:
    """Redraw the thesis' Figs 3 to 8: force over time on programmed paths, with captions."""
    from study_app.validation.thesis_figures import figures as draw

    for written in draw(to):
        click.echo(written)
