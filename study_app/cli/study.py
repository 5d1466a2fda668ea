"""The commands that describe and hold sessions."""

from __future__ import annotations

from pathlib import Path

import click
from click.core import ParameterSource

from study_app.cli.options import FILE, RESULTS, Target, keep_offered_workspace, takes_session

SEED = click.IntRange(0, 2**31 - 1)
WINDOWED = click.option("--windowed", is_flag=True, help="Show the participant's window in a frame, not full-screen.")
SCREEN = click.option("--screen", type=click.IntRange(1), help="Number of the participant's screen.")
FIRMWARE = click.option(
    "--firmware",
    type=click.Path(path_type=Path),
    metavar="PATH",
    help="Program of a Falcon that was switched on since it last ran: its owner has the file.",
)
OPERATOR = click.option("--by", "operator", default="", metavar="INITIALS", help="Who runs the session.")


@click.command()
@click.argument("protocol", metavar="FILE", required=False)
@click.option("--schema", is_flag=True, help="Print the JSON Schema of protocol files instead.")
def check(protocol: str | None, *, schema: bool) -> None:
    """Print the study or the scenes in words, or every problem of the file with line and hint."""
    from study_app.protocol import describe, load

    if schema:
        import json

        from study_app.protocol.model import schema as protocol_schema

        click.echo(json.dumps(protocol_schema(), indent=2, ensure_ascii=False))
        return
    if protocol is None:
        raise click.UsageError("check needs a protocol: a file, or one of " + ", ".join(load.shipped()))
    if load.is_scene_file(protocol):
        click.echo(describe.describe_scenes(load.load_scenes(protocol)))
    else:
        click.echo(describe.describe(load.load(protocol)))


@click.command()
@FILE
@click.option("--participants", type=click.IntRange(1, 9999), required=True)
@click.option("--seed", type=SEED, default=1, show_default=True)
def design(protocol: str, participants: int, seed: int) -> None:
    """Count positions and carry-over of the orders of N participants, before anyone is invited."""
    from study_app.protocol.load import load
    from study_app.protocol.orders.balance import balance, describe_balance, numbered

    click.echo(describe_balance(balance(load(protocol), numbered(participants), seed)))


@click.command()
@FILE
@click.option("--participant", metavar="ID", required=True, help="Letters and digits, such as P007.")
@click.option("--session", type=click.IntRange(1, 99), default=1, show_default=True, help="Session number.")
@click.option("--seed", type=SEED, help="Default: drawn, shown and recorded.")
@click.option(
    "--device",
    default="mouse",
    show_default=True,
    metavar="NAME",
    help="mouse, falcon, falcon:SERIAL, spacemouse, scripted, falcon-emulated or falcon-socket:PATH; see devices.",
)
@FIRMWARE
@click.option("--language", metavar="LANG", help="Default: the protocol's first.")
@OPERATOR
@WINDOWED
@SCREEN
@click.option("--pilot", is_flag=True, help="Try it out: windowed, marked, kept apart in results/<study>-pilot.")
@click.option("--no-recordings", is_flag=True, help="Keep answers and trial rows only, not every sample and frame.")
@RESULTS
def run(
    protocol: str,
    participant: str,
    session: int,
    seed: int | None,
    device: str,
    firmware: Path | None,
    language: str | None,
    operator: str,
    *,
    windowed: bool,
    screen: int | None,
    pilot: bool,
    no_recordings: bool,
    results: Path | None,
) -> None:
    """Run a session with a participant, without dialogs."""
    from study_app import app

    if results is None:
        keep_offered_workspace()
    code = app.run(
        protocol,
        participant=participant,
        session=session,
        seed=seed,
        device=device,
        firmware=firmware,
        language=language,
        operator=operator,
        windowed=windowed,
        screen=screen,
        results=results,
        pilot=pilot,
        recordings=not no_recordings,
        tell=click.echo,
    )
    click.get_current_context().exit(code)


@click.command()
@FILE
@click.option("--participants", type=click.IntRange(1, 99_999), default=1, show_default=True)
@click.option("--seed", type=SEED, default=1, show_default=True)
@click.option("--device", default="scripted", show_default=True, metavar="NAME", help="scripted or falcon-emulated.")
@click.option("--no-recordings", is_flag=True, help="Keep answers and trial rows only, not every sample and frame.")
@click.option(
    "--answers-only",
    is_flag=True,
    help="Thousands of participants in seconds, to try an analysis: four sessions are rehearsed and kept nowhere, then "
    "everybody answers by what was felt in one of them. Nothing is measured: those columns say n/a. Sessions are "
    "written whole, without waiting for the disk.",
)
@click.option(
    "--results",
    type=Target(),
    metavar="DIR",
    help="Study folder; default: a new results/<study>-rehearsal-1 of the workspace.",
)
@click.pass_context
def rehearse(
    context: click.Context,
    protocol: str,
    participants: int,
    seed: int,
    device: str,
    *,
    no_recordings: bool,
    answers_only: bool,
    results: Path | None,
) -> None:
    """Run whole sessions with simulated participants, faster than real time; every row says simulated."""
    if results is None:
        keep_offered_workspace()
    if answers_only:
        if context.get_parameter_source("device") is not ParameterSource.DEFAULT:
            raise click.UsageError("--answers-only needs no device: leave out --device")
        from study_app.session.simulated.answers_only import rehearse_answers

        folder = rehearse_answers(protocol, participants=participants, seed=seed, results=results, progress=click.echo)
    else:
        from study_app.session.simulated.rehearsal import rehearse as rehearse_study

        folder = rehearse_study(
            protocol,
            participants=participants,
            seed=seed,
            device=device,
            results=results,
            recordings=not no_recordings,
            progress=click.echo,
        )
    click.echo(f"{folder}: {participants} simulated participant{'s' if participants > 1 else ''}")


@click.command()
@takes_session
@click.option("--protocol", metavar="FILE", help="Its protocol; default: looked for among those at hand.")
@click.option("--device", metavar="NAME", help="Default: the one it began with.")
@FIRMWARE
@OPERATOR
@WINDOWED
@SCREEN
def resume(
    session: Path,
    protocol: str | None,
    device: str | None,
    firmware: Path | None,
    operator: str,
    *,
    windowed: bool,
    screen: int | None,
) -> None:
    """Go on with a session whose program was ended: same order and seed, at the interrupted trial."""
    from study_app import app

    code = app.resume(
        session,
        protocol=protocol,
        device=device,
        firmware=firmware,
        operator=operator,
        windowed=windowed,
        screen=screen,
        tell=click.echo,
    )
    click.get_current_context().exit(code)
