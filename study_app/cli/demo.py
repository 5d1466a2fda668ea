"""The demo: a small simulated study from the first compilation to the report, and the window with its results."""

import os
from functools import partial
from pathlib import Path
from typing import Final

import click

from study_app.cli.options import EXIT_FOUND, exit_if, keep_offered_workspace, progress
from study_app.number_text import counted

STUDY: Final = "demo"
FOLDER: Final = "demo-simulated"
"""The study folder, which differs from those of real sessions and of `rehearse`."""
DEVICE: Final = "falcon-emulated"
PARTICIPANTS: Final = ("P001", "P002")
SEED: Final = 4
"""With this seed, every trial is within the study's limits for valid trials."""
_INVISIBLE_PLATFORMS: Final = ("offscreen", "minimal", "minimalegl")
"""Qt platforms that show no windows."""


@click.command()
@click.option("--no-window", is_flag=True, help="Do not open the program to show the results.")
@click.pass_context
def demo(context: click.Context, *, no_window: bool) -> None:
    """Run the demo study with two simulated participants on an emulated Falcon, write the report, and show the results.

    The demo uses the session runner, the servo, and the Falcon's own driver on an emulated device. It does not need a
    display; if there is one, the program opens and shows the results. If the demo was interrupted, run it again to
    complete it.
    """
    from study_app.workspace import workspace

    keep_offered_workspace()
    study = workspace().results.absolute() / FOLDER
    report = workspace().folder.absolute() / f"{FOLDER}-report"
    click.echo(f"Demo study with {counted(len(PARTICIPANTS), 'simulated participant')} on an emulated Falcon")
    _run_sessions(study)
    _open_key(study)
    failed = _write_report(study, report)
    click.echo(f"Sessions and tables: {study}")
    if (report / "report.html").is_file():
        click.echo(f"Report with figures and tables: {report / 'report.html'}")
    if not no_window:
        context.exit(_show_results(study) or (EXIT_FOUND if failed else 0))
    exit_if(failed)


def _run_sessions(study: Path) -> None:
    """Run or resume the session of each participant to its end."""
    from study_app.protocol.source import shipped_file
    from study_app.session.simulated.rehearsal import finish_session
    from study_app.store.files import StudyFolder
    from study_app.store.sessions import used_ids

    protocol = shipped_file(STUDY)
    if not used_ids(StudyFolder(study)).held:
        click.echo("Preparing the force model: it is compiled once on this computer, which takes up to a minute")
        with progress() as show:
            show("compiling")
            _compile_everything(protocol)
    for participant in PARTICIPANTS:
        finish_session(protocol, participant, seed=SEED, device=DEVICE, results=study, progress=click.echo)


def _compile_everything(protocol: Path) -> None:
    """Compile driver and emulator here and the servo in another process, which saves 13 s of processor time."""
    from study_app.workers.executors import Workers, open_executor

    with open_executor(Workers(1)) as executor:
        servo = executor.submit(_run_servo, protocol, "scripted", ticks=1)
        _run_servo(protocol, DEVICE, ticks=0)
        servo.result()


def _run_servo(protocol: Path, device: str, *, ticks: int) -> None:
    """Open a simulated device as in a session, run the servo for some ticks, and close both."""
    from study_app.protocol.load import load
    from study_app.session.simulated.rehearsal import rehearsal_rig

    with rehearsal_rig(load(protocol), PARTICIPANTS[0], SEED, device) as rig:
        if ticks:
            rig.servo.advance(ticks)


def _open_key(study: Path) -> None:
    """Open the key of the simulated study, unless it is open."""
    from study_app.store.unblinding import is_unblinded, unblind_folder

    if is_unblinded(study):
        return
    for unblinding in unblind_folder(study, by="demo", reason="all participants are simulated").values():
        for sentence in unblinding.left:
            click.echo(f"warning: {sentence}", err=True)
    click.echo("The key has been opened: the tables now contain the conditions")


def _write_report(study: Path, to: Path) -> list[str]:
    """Write the report unless it exists; return the sections that failed."""
    from study_app.errors import MissingExtra, naming_the_extra
    from study_app.store.files import outputs

    failed: list[str] = []
    if any(output.to == to.resolve() and len(output.paths) == len(output.files) for output in outputs(study)):
        return failed
    try:
        with progress() as show, naming_the_extra():
            from study_app.analysis.report import report

            files = report(study, to, progress=show, warn=partial(click.echo, err=True), failed=failed.append)
    except MissingExtra as error:
        click.echo(f"No report: {error}")
        return failed
    click.echo(f"Report written: {counted(len(files), 'file')}")
    for line in failed:
        click.echo(line, err=True)
    return failed


def _show_results(study: Path) -> int:
    """Show the results in the main window and return the exit code; without a display, explain how to and return 0."""
    from study_app.errors import DisplayError
    from study_app.gui.display_check import check_display, missing_window_library

    platform = os.environ.get("QT_QPA_PLATFORM", "").partition(":")[0]
    try:
        check_display()
        if platform not in _INVISIBLE_PLATFORMS:
            from study_app import app

            click.echo("The program is now opening to show these results; close its window to finish")
            return int(app.run_home_window(then=lambda visit: visit.show_study(study)))
        reason = f"QT_QPA_PLATFORM={platform} does not show windows"
    except DisplayError as error:
        reason = missing_window_library() or str(error)
    click.echo(f"The program was not opened: {reason}; open it later with: liquid-study")
    return 0
