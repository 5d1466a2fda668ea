"""The commands: parse words, call one function, give an exit code.

0 done · 1 a bug (with traceback) · 2 something the user can mend (one line) · 3 a check that found something.
Each command imports what it needs when it runs, so that ``--help`` loads neither Qt nor the compiler.
"""

from __future__ import annotations

import sys
from pathlib import Path

import click

from study_app import __version__
from study_app.errors import StudyError

EXIT_USER_ERROR = 2
EXIT_FOUND = 3

_FILE = click.argument("protocol", metavar="FILE")
_SESSION = click.argument("session", type=click.Path(path_type=Path))
_RESULTS = click.option(
    "--results",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Study folder; default results/<study>.",
)


@click.group(invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="liquid-study")
@click.pass_context
def commands(context: click.Context) -> None:
    """Run, record and analyse studies of how liquids feel.

    Without a command the home window opens. FILE is a protocol or scene file, or the name of a shipped one (rek2024,
    demo); RESULTS is a study folder such as results/rek2024.
    """
    if context.invoked_subcommand is None:
        from study_app import app

        context.exit(app.home())


@commands.command()
@click.argument("protocol", metavar="FILE", required=False)
@click.option("--schema", is_flag=True, help="Print the JSON Schema of protocol files instead.")
def check(protocol: str | None, *, schema: bool) -> None:
    """Print the study in words, or every problem of the file with line and hint."""
    from study_app.protocol import describe, load

    if schema:
        import json

        from study_app.protocol.model import schema as protocol_schema

        click.echo(json.dumps(protocol_schema(), indent=2, ensure_ascii=False))
        return
    if protocol is None:
        raise click.UsageError("check needs a protocol: a file, or one of " + ", ".join(load.shipped()))
    click.echo(describe.describe(load.load(protocol)))


@commands.command()
@click.option("--scene", required=True, metavar="FILE", help="Protocol or scene file, or the name of a shipped one.")
@click.option("--liquid", required=True, metavar="NAME", help="Id of the liquid in that file.")
@click.option("--path", required=True, metavar="PATH", help="Motion CSV, or a programmed path: circle, line, stop …")
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="OUT", help="CSV to write.")
@click.option("--set", "changes", multiple=True, metavar="NAME=VALUE", help="Override a parameter; may come again.")
def simulate(scene: str, liquid: str, path: str, out: Path, changes: tuple[str, ...]) -> None:
    """Compute the force along a motion, with the servo's own tick, without a device or a clock."""
    from study_app.haptics import motion, offline, paths
    from study_app.haptics.override import override_all
    from study_app.protocol.load import load_scene

    chosen = override_all(load_scene(scene, liquid), dict(_assignment(change) for change in changes))
    moved = paths.path(path, rate_hz=chosen.rate_hz) if path in paths.NAMES else motion.read(Path(path))
    table = offline.simulate(chosen, moved)
    motion.write(out, table)
    click.echo(f"{out}: {len(table)} rows")


def _assignment(change: str) -> tuple[str, str]:
    name, separator, value = change.partition("=")
    if not separator:
        raise click.UsageError(f"--set {change}: write NAME=VALUE, such as --set density_kg_m3=1200")
    return name.strip(), value.strip()


@commands.command()
@click.argument("scene", metavar="FILE")
@click.option("--liquid", metavar="NAME", help="Only this one; default: every liquid of the file.")
def scene(scene: str, liquid: str | None) -> None:
    """Print which effects a scene calls for, why, and the measured cost of each."""
    from study_app.evaluation.cost import report
    from study_app.protocol.load import load_scene, load_scenes

    chosen = [load_scene(scene, liquid)] if liquid else list(load_scenes(scene).values())
    click.echo("\n\n".join(report(one) for one in chosen))


@commands.command()
@click.option("--to", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder to write into.")
def figures(to: Path) -> None:
    """Draw the thesis' Figs 3 to 8 anew: force over time on programmed paths, with captions."""
    from study_app.evaluation.figures import figures as draw

    for written in draw(to):
        click.echo(written)


@commands.command()
@_FILE
@click.option("--participant", metavar="ID", required=True, help="Letters and digits, such as P007.")
@click.option("--session", type=click.IntRange(1, 99), default=1, show_default=True, help="Session number.")
@click.option("--seed", type=click.IntRange(0), help="Default: drawn, shown and recorded.")
@click.option("--device", default="mouse", show_default=True, metavar="NAME", help="mouse or scripted.")
@click.option("--language", metavar="LANG", help="Default: the protocol's first.")
@click.option("--operator", default="", metavar="INITIALS", help="Who runs the session.")
@click.option("--windowed", is_flag=True, help="Show the participant's window in a frame, not full-screen.")
@click.option("--screen", type=click.IntRange(1), help="Number of the participant's screen.")
@_RESULTS
def run(
    protocol: str,
    participant: str,
    session: int,
    seed: int | None,
    device: str,
    language: str | None,
    operator: str,
    *,
    windowed: bool,
    screen: int | None,
    results: Path | None,
) -> None:
    """Run a session with a participant, without dialogs."""
    from study_app import app

    code = app.run(
        protocol,
        participant=participant,
        session=session,
        seed=seed,
        device=device,
        language=language,
        operator=operator,
        windowed=windowed,
        screen=screen,
        results=results,
    )
    click.get_current_context().exit(code)


@commands.command()
@_FILE
@click.option("--participants", type=click.IntRange(1, 9999), required=True)
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True)
def design(protocol: str, participants: int, seed: int) -> None:
    """Count positions and carry-over of the orders of N participants, before anyone is invited."""
    from study_app.protocol.design import balance, describe_balance, numbered
    from study_app.protocol.load import load

    click.echo(describe_balance(balance(load(protocol), numbered(participants), seed)))


@commands.command()
@_FILE
@click.option("--participants", type=click.IntRange(1, 999), default=1, show_default=True)
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True)
@_RESULTS
def rehearse(protocol: str, participants: int, seed: int, results: Path | None) -> None:
    """Run whole sessions with simulated participants, faster than real time; every row says simulated."""
    from study_app.session.rehearsal import rehearse as rehearse_study

    folder = rehearse_study(protocol, participants=participants, seed=seed, results=results, progress=click.echo)
    click.echo(f"{folder}: {participants} simulated participant{'s' if participants > 1 else ''}")


@commands.command()
@click.argument("results", type=click.Path(path_type=Path))
@click.option("--to", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder to write into.")
def export(results: Path, to: Path) -> None:
    """Write the tidy tables of all participants, with a codebook."""
    from study_app.analysis.export import export as export_study

    for written in export_study(results, to):
        click.echo(written)


@commands.command()
@click.argument("results", type=click.Path(path_type=Path))
@click.option("--to", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder to write into.")
def plot(results: Path, to: Path) -> None:
    """Draw the responses: by code until unblinded, by name after."""
    from study_app.analysis.figures import plot as plot_study

    for written in plot_study(results, to):
        click.echo(written)


@commands.command()
@click.argument("results", type=click.Path(path_type=Path))
@click.option("--by", required=True, metavar="NAME", help="Who opens the key.")
@click.option("--reason", required=True, metavar="TEXT", help="Why; recorded with the time.")
def unblind(results: Path, by: str, reason: str) -> None:
    """Open the sealed key of a study; who, when and why are recorded."""
    from study_app.store.blinding import reveal

    for block, codes in reveal(results, by=by, reason=reason).items():
        for code, condition in codes.items():
            click.echo(f"{block}  {code}  {condition}")


@commands.command()
@_SESSION
def rebuild(session: Path) -> None:
    """Make a session's tables again from its journal."""
    from study_app.store.rebuild import rebuild as rebuild_session

    made = rebuild_session(session)
    for path in made.rewritten:
        click.echo(f"rewritten  {path}")
    for path in made.swept:
        click.echo(f"removed    {path}, left half-written")
    if made.torn_bytes:
        click.echo(f"the journal ends in {made.torn_bytes} bytes of a line that was never finished; left as they are")
    if not (made.rewritten or made.swept):
        click.echo("nothing to do: every table is what the journal says")


@commands.command()
@_SESSION
def reproduce(session: Path) -> None:
    """Make a session's orders again from its receipt and compare them with those that were run."""
    from study_app.store.reproduced import reproduced

    differences = reproduced(session)
    for difference in differences:
        click.echo(difference)
    click.echo("the orders differ" if differences else "reproduced: trials and statements came in the receipt's order")
    if differences:
        click.get_current_context().exit(EXIT_FOUND)


@commands.command()
@click.argument("folder", type=click.Path(path_type=Path))
def verify(folder: Path) -> None:
    """Check everything in a study's folder: columns, checksums, receipts, journals, key, recordings, Psych-DS."""
    from study_app.store.verify import verify as verify_study

    found = verify_study(folder)
    for kind, findings in (
        ("error", (*found.errors, *found.psychds.errors)),
        ("warning", (*found.warnings, *found.psychds.warnings)),
    ):
        for finding in findings:
            click.echo(f"{kind}: {finding}")
    click.echo(f"{found.sessions} sessions: {'sound' if found.sound else 'not sound'}")
    if not found.sound:
        click.get_current_context().exit(EXIT_FOUND)


@commands.command()
@click.argument("results", type=click.Path(path_type=Path))
@click.option("--participant", required=True, metavar="ID")
@click.option("--session", type=click.IntRange(1, 99), default=1, show_default=True)
@click.option("--trial", type=click.IntRange(1), help="Only this trial; default: the whole session.")
@click.option("--by", required=True, metavar="NAME", help="Who decides, or the rule's name.")
@click.option("--reason", required=True, metavar="TEXT")
def exclude(results: Path, participant: str, session: int, trial: int | None, by: str, reason: str) -> None:
    """Leave a session or a trial out of the analysis, with a reason; nothing is deleted."""
    from study_app.store.exclusions import exclude as exclude_from
    from study_app.store.exclusions import named

    click.echo(named(exclude_from(results, participant, session, trial=trial, by=by, reason=reason)))


def main() -> None:
    """Run a command; turn what the user can mend into one line and exit code 2."""
    try:
        code = commands.main(standalone_mode=False)
    except click.UsageError as error:
        command = error.ctx.command_path if error.ctx else "liquid-study"
        click.echo(f"{command}: {error.format_message()} (see {command} --help)", err=True)
        sys.exit(EXIT_USER_ERROR)
    except (click.Abort, KeyboardInterrupt):
        sys.exit(130)
    except StudyError as error:
        click.echo(f"liquid-study: {error}", err=True)
        sys.exit(EXIT_USER_ERROR)
    sys.exit(code if isinstance(code, int) else 0)
