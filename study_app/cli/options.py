"""The arguments, options, groups and exit codes that commands share."""

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any, Final, TypeVar

import click

EXIT_USER_ERROR = 2
EXIT_FOUND = 3

GROUPS: Final = {
    "Study": "new edit check design power preregister run resume rehearse studies sessions workspace",
    "Data": "export plot report unblind exclude include withdraw merge verify rebuild reproduce replay",
    "Model": "scene simulate identify estimate figures",
    "Evidence": "accuracy stability timing soak cfd validate validate-report delay-thresholds screenshots",
    "Devices": "devices outlets emulate-falcon",
}

LONGEST: Final = 150
"""Characters of a command's first sentence in ``--help``, which wraps it."""

Command = TypeVar("Command", bound=Callable[..., Any])


class GroupedCommands(click.Group):
    """Commands that ``--help`` lists under the headings of `GROUPS`."""

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands by group."""
        width = max(map(len, self.commands))
        for heading, names in GROUPS.items():
            listed = [(name, self.commands[name]) for name in names.split()]
            with formatter.section(heading):
                formatter.write_dl(
                    [(name.ljust(width), command.get_short_help_str(LONGEST)) for name, command in listed]
                )


class Target(click.Path):
    """A path to write to; an empty one, which would be the folder one is in, is refused."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path."""
        if not str(value):
            self.fail("is empty: name a file or folder (. is the current folder)", param, ctx)
        return super().convert(value, param, ctx)


FILE = click.argument("protocol", metavar="FILE")
SCENE_FILE = click.argument("scene", metavar="FILE")
BY = click.option("--by", required=True, metavar="NAME", help="Name or initials of the person, or a rule.")
PARTICIPANT = click.option("--participant", required=True, metavar="ID", help="Participant, such as P007.")
SESSION = click.option("--session", type=click.IntRange(1, 99), default=1, show_default=True, help="Session number.")
REASON = click.option("--reason", required=True, metavar="TEXT", help="Reason; recorded with the time.")
RESULTS = click.option(
    "--results", type=Target(), metavar="DIR", help="Study folder; default: results/<study> of the workspace."
)


def exclude_each_other(**given: object) -> None:
    """Refuse options, by name, of which more than one is given (neither None nor False)."""
    names = [f"--{name}" for name, value in given.items() if value is not None and value is not False]
    if len(names) > 1:
        raise click.UsageError(f"{' and '.join(names)} exclude each other: give one of them")


def takes_study(function: Command) -> Command:
    """Give a command RESULTS, or ``--results DIR`` instead; the function gets the study's folder as ``results``."""

    @click.argument("named", metavar="[RESULTS]", required=False)
    @RESULTS
    @wraps(function)
    def run(*words: Any, named: str | None, results: Path | None, **options: Any) -> Any:
        return function(*words, results=study_at(named, results), **options)

    return run  # type: ignore[return-value]


def takes_session(function: Command) -> Command:
    """Give a command SESSION; the function gets the session's folder as ``session``."""

    @click.argument("session", metavar="SESSION")
    @RESULTS
    @wraps(function)
    def run(*words: Any, session: str, results: Path | None, **options: Any) -> Any:
        return function(*words, session=session_at(session, results), **options)

    return run  # type: ignore[return-value]


def study_at(named: str | None, results: Path | None) -> Path:
    """Return a study's folder: a path, or the name of one in the workspace."""
    from study_app.workspace import workspace

    if (named is None) == (results is None):
        raise click.UsageError("name one study: RESULTS, or --results DIR (liquid-study studies lists them)")
    if results is not None:
        return results
    path = Path(str(named))
    inside = workspace().results / path
    return inside if path.name == named and not path.is_dir() and inside.is_dir() else path


def session_at(named: str, results: Path | None) -> Path:
    """Return a session's folder: a path, or STUDY/PARTICIPANT/NUMBER as ``sessions`` lists it (default: number 1).

    With ``results``, a study's folder, the name is PARTICIPANT/NUMBER.
    """
    from study_app.store.sites.merged import session_in
    from study_app.workspace import workspace

    path = Path(named)
    if path.is_dir() and results is None:
        return path
    study, rest = (Path(path.parts[0]), path.parts[1:]) if results is None else (results.absolute(), path.parts)
    number = rest[1] if len(rest) == 2 else "1"
    if len(rest) in (1, 2) and number.isdecimal():
        place = session_in(workspace().results / study, rest[0], int(number)).path
        return place if place.is_dir() else path
    return path


def keep_offered_workspace() -> None:
    """Make the offered workspace this machine's, and say so, where none was chosen: data are about to go there."""
    from study_app.store.workstation import keep_workspace
    from study_app.workspace import chosen_workspace, offered_workspace

    if chosen_workspace() is None:
        offered = offered_workspace()
        keep_workspace(offered)
        click.echo(f"workspace of this machine: {offered.folder} (liquid-study workspace DIR changes it)", err=True)
