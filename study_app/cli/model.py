"""The commands about the force model: its forces, and its parameters from measurements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from study_app.cli.options import SCENE_FILE, Target, echo_files, progress
from study_app.haptics.model.device_dynamics import ASSUMED_TICKS, MOST_DELAY

if TYPE_CHECKING:
    from study_app.haptics.model.scene import Scene

_LIQUID = click.option("--liquid", required=True, metavar="NAME", help="ID of the liquid in that file.")
_INITIAL = click.option(
    "--set", "changes", multiple=True, metavar="NAME=VALUE", help="Initial value, or a fixed parameter."
)


@click.command()
@SCENE_FILE
@_LIQUID
@click.option("--path", required=True, metavar="PATH", help="Motion CSV, or a programmed path: circle, line, stop …")
@click.option("--to", required=True, type=Target(), metavar="CSV", help="File to write.")
@click.option("--set", "changes", multiple=True, metavar="NAME=VALUE", help="Override a parameter; repeatable.")
def simulate(scene: str, liquid: str, path: str, to: Path, changes: tuple[str, ...]) -> None:
    """Compute the force along a motion, with the servo's own tick, without a device or a clock.

    Every row of the motion is one tick: provide rows at the scene's rate (1 kHz unless its rate_hz differs).
    """
    from study_app import api
    from study_app.store import csv_files

    table = api.simulate_force(scene, liquid, path, **_parse_changes(changes))
    csv_files.write_columns(to, table)
    click.echo(f"{to}: {len(table)} rows")


def _changed_scene(file: str, liquid: str, changes: tuple[str, ...]) -> Scene:
    """Return the scene of one liquid of a file, with each --set."""
    from study_app.haptics.model.overrides import override_all
    from study_app.protocol.load import load_scene

    return override_all(load_scene(file, liquid), _parse_changes(changes))


def _parse_changes(changes: tuple[str, ...]) -> dict[str, str]:
    values = {}
    for change in changes:
        name, separator, value = change.partition("=")
        if not separator:
            raise click.UsageError(f"--set {change}: write NAME=VALUE, such as --set density_kg_m3=1200")
        values[name.strip()] = value.strip()
    return values


@click.command()
@SCENE_FILE
@click.option("--liquid", metavar="NAME", help="Only this liquid; default: every liquid of the file.")
@click.option(
    "--delay",
    type=click.IntRange(0, MOST_DELAY),
    default=ASSUMED_TICKS,
    show_default=True,
    metavar="TICKS",
    help="The device's delay, used for the expected error.",
)
def scene(scene: str, liquid: str | None, delay: int) -> None:
    """Print the effects that a scene needs and why, the measured cost of each, and the expected force error."""
    from study_app.evidence.cost import report
    from study_app.evidence.expected_error import acting_report, error_report
    from study_app.protocol.load import load_scene, load_scenes

    chosen = [load_scene(scene, liquid)] if liquid else list(load_scenes(scene).values())
    click.echo(
        "\n\n".join(
            f"{report(subject)}\n{error_report(subject, delay)}\n{acting_report(subject)}".rstrip()
            for subject in chosen
        )
    )


@click.command()
@click.option("--to", required=True, type=Target(), metavar="DIR", help="Folder to write into.")
def figures(to: Path) -> None:
    """Redraw Figures 3 to 8 of the thesis: force over time on programmed paths, with captions."""
    from study_app.evidence.thesis_figures import figures as draw

    echo_files(draw(to))


@click.command()
@SCENE_FILE
@click.option(
    "--measured",
    required=True,
    type=click.Path(path_type=Path),
    metavar="CSV",
    help="Motion and force, or a flow curve.",
)
@_LIQUID
@click.option("--fit", "names", required=True, metavar="NAMES", help="Parameters, such as drag_coefficient,length.")
@_INITIAL
@click.option(
    "--velocity",
    type=click.Choice(["centred", "scene"]),
    default="centred",
    show_default=True,
    help="How to estimate velocities that are missing in the CSV: without lag (centred), or with the scene's "
    "filter (scene).",
)
@click.option("--to", type=Target(), metavar="DIR", help="Folder for preset, residuals and figure.")
def identify(
    measured: Path, scene: str, liquid: str, names: str, changes: tuple[str, ...], velocity: str, to: Path | None
) -> None:
    """Fit a liquid's parameters to measured motion and force, or to a flow curve, with intervals and warnings.

    CSV has columns t_s, x_m, y_m, z_m, fx_n, fy_n, fz_n (scene frame; the liquid's force on the ball), and vx_mps,
    vy_mps, vz_mps if they are known; or t_s, velocity_mps, force_n for a motion along one line; or, from a rheometer,
    shear_rate_per_s, shear_stress_pa.
    """
    from study_app.lab.identify import measured_force as measurements
    from study_app.lab.identify import preset as identified
    from study_app.lab.identify.fit import CurveFit, Fit, fit, fit_curve

    chosen = _changed_scene(scene, liquid, changes)
    read = measurements.read_measurement(measured)
    fitted = [name.strip() for name in names.split(",")]
    fitted_liquid: Fit | CurveFit
    with progress() as show:
        show(f"fitting {names}")
        if isinstance(read, measurements.FlowCurve):
            fitted_liquid = fit_curve(chosen, liquid, fitted, read)
        else:
            motion = measurements.with_centred_velocity(read.motion) if velocity == "centred" else read.motion
            fitted_liquid = fit(chosen, liquid, fitted, motion, read.force_n)
    click.echo(identified.report_text(fitted_liquid))
    echo_files(identified.write_fit(fitted_liquid, to, measured) if to is not None else ())
