"""The command that finds a liquid's parameters in measurements."""

from __future__ import annotations

from pathlib import Path

import click

from study_app.cli.model import assignment
from study_app.cli.options import SCENE_FILE, Target
from study_app.cli.progress import progress


@click.command()
@SCENE_FILE
@click.option(
    "--measured",
    required=True,
    type=click.Path(path_type=Path),
    metavar="CSV",
    help="Motion and force, or a flow curve.",
)
@click.option("--liquid", required=True, metavar="NAME", help="Id of the liquid in that file.")
@click.option("--fit", "names", required=True, metavar="NAMES", help="Parameters, such as drag_coefficient,length.")
@click.option("--set", "changes", multiple=True, metavar="NAME=VALUE", help="Initial value, or a fixed parameter.")
@click.option(
    "--velocity",
    type=click.Choice(["centred", "scene"]),
    default="centred",
    show_default=True,
    help="If the CSV has no velocities: estimate them without lag (centred), or with the scene's filter (scene).",
)
@click.option("--to", type=Target(), metavar="DIR", help="Folder for preset, residuals and figure.")
def identify(
    measured: Path, scene: str, liquid: str, names: str, changes: tuple[str, ...], velocity: str, to: Path | None
) -> None:
    """Fit a liquid's parameters to measured motion and force, or to a flow curve, with intervals and warnings.

    CSV has columns t_s, x_m, y_m, z_m, fx_n, fy_n, fz_n (scene frame; the liquid's force on the ball), and vx_mps,
    vy_mps, vz_mps where they are known; or t_s, velocity_mps, force_n for a motion along one line; or, from a
    rheometer, shear_rate_per_s, shear_stress_pa.
    """
    from study_app.evaluation.identify import measured_force as measurements
    from study_app.evaluation.identify import preset as identified
    from study_app.evaluation.identify.fit import Fit, fit
    from study_app.evaluation.identify.flow_curve import CurveFit, fit_curve
    from study_app.haptics.model.overrides import override_all
    from study_app.protocol.load import load_scene

    chosen = override_all(load_scene(scene, liquid), dict(assignment(change) for change in changes))
    read = measurements.read(measured)
    fitted = [name.strip() for name in names.split(",")]
    found: Fit | CurveFit
    with progress() as show:
        show(f"fitting {names}")
        if isinstance(read, measurements.FlowCurve):
            found = fit_curve(chosen, liquid, fitted, read)
        else:
            motion = measurements.centred(read.motion) if velocity == "centred" else read.motion
            found = fit(chosen, liquid, fitted, motion, read.force_n)
    click.echo(identified.text(found))
    for written in identified.write(found, to, measured) if to is not None else ():
        click.echo(written)
