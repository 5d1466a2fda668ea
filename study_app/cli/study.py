"""The commands about studies: protocols, sessions, the workspace and the documentation."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import click
from click.core import ParameterSource

from study_app.cli.options import (
    FILE,
    RESULTS,
    SESSION,
    DeviceName,
    TakesDeviceOptions,
    Target,
    WholeNumber,
    echo_files,
    keep_offered_workspace,
    study_at,
    takes_session,
)
from study_app.designer.templates import templates
from study_app.devices import DEFAULT_DEVICE
from study_app.haptics.model.device_dynamics import ASSUMED_TICKS, MOST_DELAY
from study_app.number_text import counted

SEED = WholeNumber(0, 2**31 - 1)
_WINDOWED = click.option(
    "--windowed", is_flag=True, help="Show the participant's window as a normal window instead of full screen."
)
_SCREEN = click.option("--screen", type=WholeNumber(1), help="Number of the participant's screen.")
_OPERATOR = click.option("--operator", default="", metavar="INITIALS", help="Name or initials of the operator.")


@click.command()
@click.argument("protocol", metavar="FILE", required=False)
@click.option(
    "--schema",
    is_flag=False,
    flag_value="protocol",
    type=click.Choice(["protocol", "journal"]),
    help="Instead, print the JSON Schema for protocol files, or for the lines of a session's journal.",
)
@click.option(
    "--delay-ticks",
    type=WholeNumber(1, MOST_DELAY),
    default=ASSUMED_TICKS,
    show_default=True,
    help="Force delay [ticks] to assume when checking levels; the pre-flight check uses the device's measured delay.",
)
def check(protocol: str | None, *, schema: str | None, delay_ticks: int) -> None:
    """Describe the study or the scenes in a file, or list every problem in it with a line number and a hint."""
    from study_app.protocol import descriptions, load

    if schema:
        import json

        from study_app.protocol.file_format import editor_schema
        from study_app.store.journals.journal_events import journal_schema

        json_schema = editor_schema() if schema == "protocol" else journal_schema()
        click.echo(json.dumps(json_schema, indent=2, ensure_ascii=False))
        return
    if protocol is None:
        raise click.UsageError("check needs a protocol: specify a file, or one of " + ", ".join(load.shipped()))
    if load.is_scene_file(protocol):
        click.echo(descriptions.describe_scenes(load.load_scenes(protocol)))
    else:
        import time

        from study_app.protocol.source import protocol_file
        from study_app.protocol.warnings import describe_untranslated
        from study_app.session.simulated.paced_levels import undelivered_levels
        from study_app.session.simulated.predicted_delivery import predicted_delivery
        from study_app.store import workstation
        from study_app.video.sources import missing_on_computer

        study = load.load(protocol, delay_ticks=delay_ticks)
        camera = workstation.load_or_default()[0].camera
        file = protocol_file(protocol)
        missing = missing_on_computer(study, file.parent, camera, time.perf_counter_ns)
        click.echo(descriptions.describe(study, delay_ticks, workstation.device_without_force()))
        document, _ = load.read_document(load.source_bytes(protocol), protocol)
        for sentence in (*undelivered_levels(study), *describe_untranslated(document, lists_places=True)):
            click.echo(f"\nNote: {sentence}.")
        delivery = predicted_delivery(study, delay_ticks)
        for sentence in delivery.sentences:
            click.echo(f"\nNote: {sentence}, predicted for a delay of {counted(delay_ticks, 'tick')}.")
        if missing:
            click.echo(f"\nNote: {missing}. Sessions of this study cannot start on this computer.")


@click.command()
@click.argument("path", metavar="PATH", type=click.Path(path_type=Path, exists=True))
def upgrade(path: Path) -> None:
    """Convert study files, liquid files and results from earlier versions to the current format.

    PATH is a file or a folder. Forces and the order of trials stay the same. Each original file is kept in the same
    folder, as NAME.toml.format-1. Result tables are rewritten with the current columns; journals and receipts are not
    changed.
    """
    from study_app.store.upgrade import upgrade as upgrade_files

    files = upgrade_files(path)
    echo_files(files)
    if not files:
        click.echo(f"{path}: nothing to upgrade")


@click.command()
@click.argument("name", metavar="NAME")
@click.option(
    "--template",
    metavar="T",
    default="empty",
    show_default=True,
    help=f"Template for the study: {', '.join(templates())}.",
)
@click.option("--no-window", is_flag=True, help="Write the file directly, without opening the study designer.")
def new(name: str, template: str, *, no_window: bool) -> None:
    """Create a study from a template, and open it in the study designer."""
    from study_app.designer.document import document as new_study

    study = new_study.template(template)
    keep_offered_workspace()
    if not no_window:
        from study_app import app

        new_study.check_free_name(name)
        code = app.run_home_window(then=lambda visit: visit.begin_new_study(f"template:{template}", name))
        click.get_current_context().exit(code)
    file = new_study.write_new(study, name)
    click.echo(f"{file}: edit it, then run liquid-study check {name}")


@click.command()
@FILE
def edit(protocol: str) -> None:
    """Open a study in the study designer."""
    from study_app import app
    from study_app.protocol.source import protocol_file

    file = protocol_file(protocol)
    name = protocol if file.name != Path(protocol).name else str(file)
    click.get_current_context().exit(app.run_home_window(then=lambda visit: visit.open_designer(name)))


@click.command()
@FILE
@click.option("--participants", type=WholeNumber(1, 9999), required=True, help="Number of participants.")
@click.option(
    "--from",
    "first",
    metavar="ID",
    default="P001",
    show_default=True,
    help="ID of the first participant; the other IDs follow consecutively.",
)
@click.option("--seed", type=SEED, default=1, show_default=True, help="Seed for the participants' random orders.")
def design(protocol: str, participants: int, first: str, seed: int) -> None:
    """Count positions and carry-over in the trial orders for N participants before the study starts."""
    from study_app.protocol.load import load
    from study_app.protocol.orders import balances, describe_balance, numbered_participants

    counts = balances(load(protocol), numbered_participants(participants, first), seed)
    click.echo("\n\n".join(map(describe_balance, counts)))


@click.command(cls=TakesDeviceOptions)
@FILE
@click.option("--participant", metavar="ID", required=True, help="Participant ID (letters and digits), such as P007.")
@SESSION
@click.option(
    "--seed", type=SEED, help="Seed for all random choices; default: a random seed, which is shown and recorded."
)
@click.option("--device", cls=DeviceName, default=DEFAULT_DEVICE, show_default=True, help="Haptic or input device.")
@click.option("--language", metavar="LANG", help="Language of the pages; default: the protocol's first language.")
@_OPERATOR
@click.option(
    "--row-of",
    metavar="ID",
    help="ID of the participant being replaced, whose trial order (and position in the group) is used again.",
)
@click.option("--group", metavar="GROUP", help="The participant's group, if the study has pre-existing groups.")
@_WINDOWED
@_SCREEN
@click.option(
    "--pilot", is_flag=True, help="Run a pilot session in a marked window, and store it in results/<study>-pilot."
)
@click.option("--no-recordings", is_flag=True, help="Store only answers and trial rows, not every sample and frame.")
@RESULTS
def run(protocol: str, *, no_recordings: bool, results: Path | None, **chosen: Any) -> None:
    """Run a session with a participant, without dialogs."""
    from study_app import app

    if results is None:
        keep_offered_workspace()
    code = app.run(protocol, results=results, recordings=not no_recordings, progress=click.echo, **chosen)
    click.get_current_context().exit(code)


@click.command()
@FILE
@click.option(
    "--participants", type=WholeNumber(1, 99_999), default=1, show_default=True, help="Number of participants."
)
@click.option("--seed", type=SEED, default=1, show_default=True, help="Seed for all random choices.")
@click.option(
    "--device", cls=DeviceName, only_moving=True, default="scripted", show_default=True, help="Simulated device."
)
@click.option("--no-recordings", is_flag=True, help="Store only answers and trial rows, not every sample and frame.")
@click.option(
    "--answers-only",
    is_flag=True,
    help=(
        "Simulate thousands of participants in seconds, to try out an analysis. Four complete sessions are simulated "
        "but not stored; each answer is then generated from the forces and delays in one of them. Measurement columns "
        "contain n/a. Files are written without waiting for confirmation from the disk."
    ),
)
@click.option(
    "--group",
    metavar="GROUP",
    help=("Pre-existing group for all participants; default: the planned ratio of the groups."),
)
@click.option(
    "--results",
    type=Target(),
    metavar="DIR",
    help="Study folder; default: a new folder results/<study>-rehearsal-1 in the workspace.",
)
@click.pass_context
def rehearse(
    context: click.Context, /, protocol: str, *, device: str, no_recordings: bool, answers_only: bool, **chosen: Any
) -> None:
    """Run all sessions with simulated participants, faster than real time; every row is marked as simulated."""
    from study_app.protocol.load import load

    if chosen["results"] is None:
        keep_offered_workspace()
    study = load(protocol)
    if study.asks_group and chosen["group"] is None:
        click.echo(
            "Simulated participants are divided among the pre-existing groups in the planned ratio: "
            + ", ".join(f"{name} {share}" for name, share in study.shares.items())
        )
    if answers_only:
        if context.get_parameter_source("device") is not ParameterSource.DEFAULT:
            raise click.UsageError("--answers-only does not use a device: omit --device")
        from study_app.session.simulated.answers_only import rehearse_answers

        folder = rehearse_answers(protocol, progress=click.echo, **chosen)
    else:
        from study_app.session.simulated.rehearsal import rehearse as rehearse_study

        folder = rehearse_study(protocol, device=device, recordings=not no_recordings, progress=click.echo, **chosen)
    click.echo(f"{folder}: {counted(chosen['participants'], 'simulated participant')}")


@click.command(cls=TakesDeviceOptions)
@takes_session
@click.option(
    "--protocol", metavar="FILE", help="The session's protocol; by default, the program searches the known protocols."
)
@click.option("--device", cls=DeviceName, help="Device; default: the one used in the interrupted session.")
@_OPERATOR
@_WINDOWED
@_SCREEN
def resume(session: Path, **chosen: Any) -> None:
    """Resume an interrupted session at the interrupted trial, with the same order and seed."""
    from study_app import app

    click.get_current_context().exit(app.resume(session, progress=click.echo, **chosen))


@click.command()
@click.argument("folder", metavar="[DIR]", required=False, type=Target())
def workspace(folder: Path | None) -> None:
    """Print this machine's workspace, the folder that contains protocols and results; with DIR, change it."""
    from study_app.store.workstation import keep_workspace
    from study_app.workspace import WORKSPACE_VARIABLE, Workspace, chosen_workspace
    from study_app.workspace import workspace as workspace_here

    if folder is not None:
        keep_workspace(Workspace(folder.absolute()))
    current = workspace_here()
    if folder is not None and current.folder.absolute() != folder.absolute():
        click.echo(f"{WORKSPACE_VARIABLE} sets another workspace for this run", err=True)
    click.echo(current.folder.absolute() if chosen_workspace() else f"{current.folder} (not chosen yet)")


@click.command()
def studies() -> None:
    """List the known protocols and the studies in the workspace."""
    from study_app.errors import ProtocolError, StoreError
    from study_app.protocol.load import is_scene_file, known_protocols, load
    from study_app.store.merged import folders_of, sessions_in
    from study_app.store.workstation import recent_protocols
    from study_app.workspace import workspace as workspace_here

    current = workspace_here()
    click.echo(f"Protocols in {current.protocols.absolute()}, shipped protocols, and recently opened protocols")
    for name in (*known_protocols(), *recent_protocols()):
        try:
            if is_scene_file(name):
                click.echo(f"  {name}  (liquid file)")
                continue
            study = load(name)
            click.echo(f"  {name}  {study.text(study.study.title, study.study.languages[0])}")
        except ProtocolError as error:
            click.echo(f"  {name}  cannot be used: {error.problems[0]}")
    click.echo(f"Studies in {current.results.absolute()}")
    for folder in _study_folders(current.results):
        try:
            folders = folders_of(folder)
        except StoreError as error:
            click.echo(f"  {folder.name}  cannot be used: {error}")
            continue
        count = len(sessions_in(folders.values()))
        sites = "" if "" in folders else f", sites {', '.join(prefix[:-1] for prefix in folders)}"
        click.echo(f"  {folder.name}  {counted(count, 'session')}{sites}")


@click.command()
@click.argument("code", metavar="CODE")
def language(code: str) -> None:
    """Check the translation of the participants' texts in the file WORKSPACE/languages/CODE.toml.

    CODE is a two-letter language code, such as es. If the file does not exist, the command creates it, with a line for
    each text and the English original as a comment.
    """
    from study_app.errors import StudyError
    from study_app.protocol.wording import SHIPPED, language_template, read_language
    from study_app.store.files import cannot_write, write_file
    from study_app.workspace import workspace as workspace_here

    if len(code) != 2 or not (code.isascii() and code.islower()):
        raise StudyError(f"{code!r} is not a language code: specify two lowercase letters, such as es")
    file = workspace_here().folder / "languages" / f"{code}.toml"
    if code in SHIPPED:
        click.echo(f"{SHIPPED[code].english_name} ships with the program")
    elif file.is_file():
        click.echo(f"{file}: complete, {read_language(file).english_name}")
    else:
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise cannot_write(file.parent, error) from error
        write_file(file, language_template(code).encode())
        click.echo(f"{file}: translate its texts, then run liquid-study language {code}")


@click.command()
@click.argument("named", metavar="[RESULTS]", required=False)
@RESULTS
def sessions(named: str | None, results: Path | None) -> None:
    """List the sessions of a study, or of every study in the workspace, with the names that other commands accept."""
    from study_app.errors import StoreError
    from study_app.store.merged import all_exclusions, session_in
    from study_app.store.tables import participants_of
    from study_app.workspace import workspace as workspace_here

    in_workspace = workspace_here().results
    folders = list(_study_folders(in_workspace)) if named is None and results is None else [study_at(named, results)]
    for folder in folders:
        if not folder.is_dir():
            raise StoreError(f"{folder} is not a folder: specify a study listed by liquid-study studies, or its path")
        excluded = {row.what for row in all_exclusions(folder)}
        inside = folder.parent.resolve() == in_workspace.resolve()
        for row in participants_of(folder):
            participant, number = row["participant"], row["session"]
            name = (
                f"{folder.name}/{participant}/{number}" if inside else str(session_in(folder, participant, number).path)
            )
            started = _local_time(row["session_started_at"])
            mark = "  excluded" if (participant, number, None) in excluded else ""
            click.echo(f"{name}  {started}  {row['status']}{mark}")


def _local_time(recorded: str | None) -> str:
    """Return a table's time as local time with its offset, to the minute; "" if it is unknown."""
    from datetime import datetime

    return datetime.fromisoformat(recorded).astimezone().isoformat(" ", "minutes") if recorded else ""


def _study_folders(results: Path) -> Iterator[Path]:
    """Yield the study folders in a folder of results, which need not exist."""
    from study_app.store.tables import study_folders

    if results.is_dir():
        yield from study_folders(results)


_SECTIONS_SHOWN: Final = 5


@click.command()
@click.argument("search_words", metavar="[PAGE | WORDS]", nargs=-1)
def docs(search_words: tuple[str, ...]) -> None:
    """Print a documentation page, such as data-dictionary, or the section that best matches the search words.

    Without an argument, the command lists all pages.
    """
    from study_app import documentation

    query = " ".join(search_words)
    if not query or query in documentation.names():
        click.echo(documentation.page(query) if query else "\n".join(documentation.names()))
        return
    sections = documentation.search(query)[:_SECTIONS_SHOWN]
    if not sections:
        raise click.UsageError(f"no page contains any of the words {query!r}: run liquid-study docs to list the pages")
    best, *others = sections
    click.echo(f"{best.page}: {best.heading}\n\n{best.source.strip()}\n")
    for section in others:
        click.echo(f"see also  {section.page}: {section.heading}")
