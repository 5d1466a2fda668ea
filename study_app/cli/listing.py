"""Commands that list the workspace, its studies and their sessions."""

from collections.abc import Iterator
from pathlib import Path

import click

from study_app.cli.options import RESULTS, Target, study_at
from study_app.number_text import counted

STARTED = 16  # letters of a time down to the minute


@click.command()
@click.argument("folder", metavar="[DIR]", required=False, type=Target())
def workspace(folder: Path | None) -> None:
    """Print the workspace, the folder of protocols and results of this machine; with DIR, change it."""
    from study_app.store.workstation import keep_workspace
    from study_app.workspace import WORKSPACE_VARIABLE, Workspace, chosen_workspace
    from study_app.workspace import workspace as workspace_here

    if folder is not None:
        keep_workspace(Workspace(folder.absolute()))
    here = workspace_here()
    if folder is not None and here.folder.absolute() != folder.absolute():
        click.echo(f"{WORKSPACE_VARIABLE} names another workspace for this run", err=True)
    click.echo(here.folder.absolute() if chosen_workspace() else f"{here.folder} (not chosen yet)")


@click.command()
def studies() -> None:
    """List the known protocols and the studies in the workspace."""
    from study_app.errors import ProtocolError, StoreError
    from study_app.protocol.load import at_hand, is_scene_file, load
    from study_app.store.sites.merged import folders_of, sessions_in
    from study_app.store.workstation import recent_protocols
    from study_app.workspace import workspace as workspace_here

    here = workspace_here()
    click.echo(f"Protocols in {here.protocols.absolute()}, shipped ones, and recently opened ones")
    for name in (*at_hand(), *recent_protocols()):
        try:
            if is_scene_file(name):
                click.echo(f"  {name}  (liquid file)")
                continue
            study = load(name)
            click.echo(f"  {name}  {study.text(study.study.title, study.study.languages[0])}")
        except ProtocolError as error:
            click.echo(f"  {name}  cannot be used: {error.problems[0]}")
    click.echo(f"Studies in {here.results.absolute()}")
    for folder in _studies(here.results):
        try:
            places = folders_of(folder)
        except StoreError as error:
            click.echo(f"  {folder.name}  cannot be used: {error}")
            continue
        count = len(sessions_in(places.values()))
        sites = "" if "" in places else f", sites {', '.join(prefix[:-1] for prefix in places)}"
        click.echo(f"  {folder.name}  {counted(count, 'session')}{sites}")


@click.command()
@click.argument("named", metavar="[RESULTS]", required=False)
@RESULTS
def sessions(named: str | None, results: Path | None) -> None:
    """List the sessions of a study, or of every study in the workspace, with the names that commands accept."""
    from study_app.errors import StoreError
    from study_app.store.sites.merged import all_exclusions, session_in
    from study_app.store.tables.study_files import participants_of
    from study_app.workspace import workspace as workspace_here

    at = workspace_here().results
    folders = list(_studies(at)) if named is None and results is None else [study_at(named, results)]
    for folder in folders:
        if not folder.is_dir():
            raise StoreError(f"{folder} is not a folder: name one that liquid-study studies lists, or its path")
        left_out = {row.what for row in all_exclusions(folder)}
        inside = folder.parent.resolve() == at.resolve()
        for row in participants_of(folder):
            who, number = row["participant"], row["session"]
            name = f"{folder.name}/{who}/{number}" if inside else str(session_in(folder, who, number).path)
            started = str(row["session_started_at"] or "")[:STARTED].replace("T", " ")
            mark = "  excluded" if (who, number, None) in left_out else ""
            click.echo(f"{name}  {started}  {row['status']}{mark}")


def _studies(results: Path) -> Iterator[Path]:
    """Yield the studies' folders, sorted."""
    from study_app.store.tables.study_files import study_folders

    if results.is_dir():
        yield from study_folders(results)
