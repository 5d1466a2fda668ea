"""The commands about the force model: simulate forces, describe scenes, fit parameters to measurements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from study_app.cli.options import SCENE_FILE, Target, WholeNumber, echo_files, progress
from study_app.haptics.model.device_dynamics import ASSUMED_TICKS, MOST_DELAY

if TYPE_CHECKING:
    from study_app.haptics.model.scene import Scene

_LIQUID = click.option("--liquid", required=True, metavar="NAME", help="ID of the liquid in FILE.")
_INITIAL = click.option(
    "--set",
    "changes",
    multiple=True,
    metavar="NAME=VALUE",
    help="Initial value of a fitted parameter, or value of a fixed one; the option can be repeated.",
)


@click.command()
@SCENE_FILE
@_LIQUID
@click.option(
    "--path", required=True, metavar="PATH", help="CSV file with a motion, or a programmed path: circle, line, stop …"
)
@click.option("--to", required=True, type=Target(), metavar="CSV", help="File to write.")
@click.option(
    "--set", "changes", multiple=True, metavar="NAME=VALUE", help="Override a parameter; the option can be repeated."
)
def simulate(scene: str, liquid: str, path: str, to: Path, changes: tuple[str, ...]) -> None:
    """Compute the force along a motion as the servo would, tick by tick, without a device or a clock.

    Each row of the motion is one tick, so the rows must be sampled at the scene's rate (1 kHz unless rate_hz is set).
    """
    from study_app import api
    from study_app.store.files import write_columns

    table = api.simulate_force(scene, liquid, path, **_parse_changes(changes))
    write_columns(to, table)
    click.echo(f"{to}: {len(table)} rows")


def _load_changed_scene(file: str, liquid: str, changes: tuple[str, ...]) -> Scene:
    """Return the scene of a liquid in a file, with the changes of ``--set``."""
    from study_app.haptics.model.overrides import override_all
    from study_app.protocol.load import load_scene

    return override_all(load_scene(file, liquid), _parse_changes(changes))


def _parse_changes(changes: tuple[str, ...]) -> dict[str, str]:
    """Return the values of ``--set`` by name."""
    values = {}
    for change in changes:
        name, separator, value = change.partition("=")
        if not separator:
            raise click.UsageError(f"--set {change}: write NAME=VALUE, such as --set density_kg_m3=1200")
        values[name.strip()] = value.strip()
    return values


@click.command()
@SCENE_FILE
@click.option("--liquid", metavar="NAME", help="Describe only this liquid; default: every liquid in the file.")
@click.option(
    "--delay",
    type=WholeNumber(0, MOST_DELAY),
    default=ASSUMED_TICKS,
    show_default=True,
    metavar="TICKS",
    help="The device's delay, used to compute the expected error.",
)
def scene(scene: str, liquid: str | None, delay: int) -> None:
    """Print which effects a scene needs and why, the computation time of each, and the expected force error."""
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
@click.option("--to", required=True, type=Target(), metavar="DIR", help="Folder to write to.")
def figures(to: Path) -> None:
    """Redraw Figures 3 to 8 of the thesis: force over time along programmed paths, with captions."""
    from study_app.evidence.thesis_figures import figures as draw

    echo_files(draw(to))


@click.command()
@SCENE_FILE
@click.option(
    "--measured",
    required=True,
    type=click.Path(path_type=Path),
    metavar="CSV",
    help="CSV file with motion and force, or with a flow curve.",
)
@_LIQUID
@click.option(
    "--fit", "names", required=True, metavar="NAMES", help="Parameters to fit, such as drag_coefficient,length."
)
@_INITIAL
@click.option(
    "--velocity",
    type=click.Choice(["centred", "scene"]),
    default="centred",
    show_default=True,
    help="How to estimate velocities that are missing from the CSV file: without lag (centred), or with the scene's "
    "filter (scene).",
)
@click.option("--to", type=Target(), metavar="DIR", help="Folder for the preset, the residuals and the figure.")
def identify(
    measured: Path, scene: str, liquid: str, names: str, changes: tuple[str, ...], velocity: str, to: Path | None
) -> None:
    """Fit a liquid's parameters to measured motion and force, or to a flow curve; print intervals and warnings.

    The CSV file must contain the columns t_s, x_m, y_m, z_m, fx_n, fy_n, fz_n (scene frame; the liquid's force on the
    ball) and, if known, vx_mps, vy_mps, vz_mps; or t_s, velocity_mps, force_n for motion along a line; or, for
    rheometer data, shear_rate_per_s, shear_stress_pa.
    """
    from study_app.lab.identify import measured_force as measurements
    from study_app.lab.identify import preset as identified
    from study_app.lab.identify.fit import CurveFit, Fit, fit, fit_curve

    chosen = _load_changed_scene(scene, liquid, changes)
    measurement = measurements.read_measurement(measured)
    fitted = [name.strip() for name in names.split(",")]
    fitted_liquid: Fit | CurveFit
    with progress() as show:
        show(f"fitting {names}")
        if isinstance(measurement, measurements.FlowCurve):
            fitted_liquid = fit_curve(chosen, liquid, fitted, measurement)
        else:
            motion = (
                measurements.with_centred_velocity(measurement.motion) if velocity == "centred" else measurement.motion
            )
            fitted_liquid = fit(chosen, liquid, fitted, motion, measurement.force_n)
    click.echo(identified.report_text(fitted_liquid))
    echo_files(identified.write_fit(fitted_liquid, to, measured) if to is not None else ())
