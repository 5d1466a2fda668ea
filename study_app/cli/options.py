"""The arguments, options, groups, exit codes, executor and progress display that commands share."""

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

import click
from click.core import ParameterSource

from study_app.workers.executors import Workers, open_executor

if TYPE_CHECKING:
    from concurrent.futures import Executor

EXIT_USER_ERROR = 2
EXIT_FOUND = 3
GROUPS: Final = {
    "Study": "demo new edit check upgrade language design power preregister run resume rehearse studies sessions "
    "workspace",
    "Data": "export plot report unblind exclude include withdraw merge verify proof rebuild reproduce replay",
    "Model": "scene simulate identify figures",
    "Evidence": "accuracy stability timing soak cfd validate validate-report delay-thresholds",
    "Devices": "devices outlets plugins",
    "Help": "docs",
}
_SAMPLES: Final = {
    "FILE": "rek2024",
    "RESULTS": "rek2024",
    "SESSION": "rek2024/P007/1",
    "NAME": "mystudy",
    "name": "falcon",
    "NAME=RESULTS...": "Delft=results/rek2024 Utrecht=utrecht/rek2024",
    "DIR": "lab",
    "PATH": "protocols",
    "--participant": "P007",
    "--participants": "12",
    "--by": "AK",
    "--reason": '"why"',
    "--to": "folder",
    "--path": "circle",
    "--measured": "measured.csv",
    "--fit": "viscosity_pa_s",
    "--liquid": "water",
    "--hours": "1",
}
"""Values of arguments and of required options in examples."""
_LONGEST: Final = 150
"""Maximum number of characters of a command's description in the list of commands."""
_Command = TypeVar("_Command", bound=Callable[..., Any])


class WholeNumber(click.IntRange):
    """A whole number; the message about any other value states the permitted range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the number, or raise click.BadParameter."""
        try:
            return super().convert(value, param, ctx)
        except click.BadParameter:
            permitted = f"of at least {self.min}" if self.max is None else f"from {self.min} to {self.max}"
            self.fail(f"{value} is not a whole number {permitted}", param, ctx)


FILE = click.argument("protocol", metavar="FILE")
SCENE_FILE = click.argument("scene", metavar="FILE")
BY = click.option("--by", required=True, metavar="NAME", help="Name or initials of the person responsible.")
PARTICIPANT = click.option("--participant", required=True, metavar="ID", help="ID of the participant, such as P007.")
SESSION = click.option("--session", type=WholeNumber(1, 99), default=1, show_default=True, help="Session number.")
REASON = click.option("--reason", required=True, metavar="TEXT", help="Reason, which is recorded with the time.")
EXIT_CANCELLED: Final = 130


class GroupedCommands(click.Group):
    """Commands that ``--help`` lists under the headings of `GROUPS`."""

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands by group."""
        width = max(map(len, self.commands))
        for heading, names in GROUPS.items():
            listed = [(name, self.commands[name]) for name in names.split()]
            with formatter.section(heading):
                formatter.write_dl(
                    [(name.ljust(width), command.get_short_help_str(_LONGEST)) for name, command in listed]
                )


def example_of(ctx: click.Context) -> str:
    """Return a command with its arguments and required options, or "" if it has none."""
    parts: list[str] = []
    for parameter in ctx.command.params:
        name = (
            parameter.opts[0]
            if isinstance(parameter, click.Option)
            else (parameter.metavar or parameter.name or "").strip("[]")
        )
        if isinstance(parameter, click.Argument) and (parameter.required or name in _SAMPLES):
            parts.append(_SAMPLES.get(name, name))
        elif isinstance(parameter, click.Option) and parameter.required:
            parts += [name, _SAMPLES.get(name, str(parameter.metavar))]
    return " ".join((ctx.command_path, *parts)) if parts else ""


class Target(click.Path):
    """A path to write to; an empty path is rejected, since it would mean the current folder."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path, or reject an empty one."""
        if not str(value):
            self.fail("is empty: specify a file or folder (. is the current folder)", param, ctx)
        return super().convert(value, param, ctx)


RESULTS = click.option(
    "--results", type=Target(), metavar="DIR", help="Study folder; default: results/<study> in the workspace."
)


def exclude_each_other(**options: object) -> None:
    """Raise a usage error if more than one of these options is given (neither None nor False)."""
    names = [f"--{name}" for name, value in options.items() if value is not None and value is not False]
    if len(names) > 1:
        raise click.UsageError(f"{' and '.join(names)} cannot be combined: specify only one of them")


def takes_study(function: _Command) -> _Command:
    """Add the argument RESULTS and ``--results DIR`` to a command; its function receives the folder as ``results``."""

    @click.argument("named", metavar="[RESULTS]", required=False)
    @RESULTS
    @wraps(function)
    def run(*arguments: Any, named: str | None, results: Path | None, **options: Any) -> Any:
        return function(*arguments, results=study_at(named, results), **options)

    return run  # type: ignore[return-value]


def takes_session(function: _Command) -> _Command:
    """Add the argument SESSION and ``--results DIR`` to a command; its function receives the folder as ``session``."""

    @click.argument("session", metavar="SESSION")
    @RESULTS
    @wraps(function)
    def run(*arguments: Any, session: str, results: Path | None, **options: Any) -> Any:
        return function(*arguments, session=_session_folder(session, results), **options)

    return run  # type: ignore[return-value]


def study_at(named: str | None, results: Path | None) -> Path:
    """Return a study's folder, from its path or its name in the workspace."""
    from study_app.workspace import workspace

    if (named is None) == (results is None):
        raise click.UsageError(
            "specify one study, as RESULTS or as --results DIR (liquid-study studies lists the studies)"
        )
    if results is not None:
        return results
    path = Path(str(named))
    inside = workspace().results / path
    return inside if path.name == named and not path.is_dir() and inside.is_dir() else path


def _session_folder(named: str, results: Path | None) -> Path:
    """Return a session's folder, from its path or its name STUDY/PARTICIPANT/NUMBER in the list of ``sessions``.

    With ``results``, a study's folder, the name is PARTICIPANT/NUMBER. The default number is 1.
    """
    from study_app.store.merged import session_in
    from study_app.workspace import workspace

    path = Path(named)
    if path.is_dir() and results is None:
        return path
    study, rest = (Path(path.parts[0]), path.parts[1:]) if results is None else (results.absolute(), path.parts)
    number = rest[1] if len(rest) == 2 else "1"
    if len(rest) in (1, 2) and number.isdecimal():
        folder = session_in(workspace().results / study, rest[0], int(number)).path
        return folder if folder.is_dir() else path
    return path


def keep_offered_workspace() -> None:
    """Store and print the suggested workspace if none was chosen, before data are written to it."""
    from study_app.store.workstation import keep_workspace
    from study_app.workspace import chosen_workspace, offered_workspace

    if chosen_workspace() is None:
        offered = offered_workspace()
        keep_workspace(offered)
        click.echo(
            f"this machine's workspace: {offered.folder} (to change it, run liquid-study workspace DIR)", err=True
        )


def exit_if(problems: object) -> None:
    """End the command with exit code 3 if a check found a problem."""
    if problems:
        raise click.exceptions.Exit(EXIT_FOUND)


def printable(text: str) -> str:
    """Return a line with unprintable characters escaped, since names of others' files may control the terminal."""
    return "".join(letter if letter.isprintable() else letter.encode("unicode_escape").decode() for letter in text)


def echo_files(written: Iterable[Path]) -> None:
    """Print the paths of the files that a command wrote."""
    for path in written:
        click.echo(path)


def make_output_folder(to: Path | None) -> None:
    """Create the output folder, if given, so that a long computation does not fail at its end."""
    from study_app.store.files import make_folder

    if to is not None:
        make_folder(to, waits=False)


class ShowProgress(Protocol):
    """Shows the current activity and, if known, the fraction done (0 to 1)."""

    def __call__(self, what: str, share: float | None = None) -> None: ...  # noqa: D102


@contextmanager
def progress(otherwise: Callable[[str], object] | None = None) -> Iterator[ShowProgress]:
    """Show progress below the output, on standard error, until the end of the block.

    Outside a terminal, ``otherwise`` is called with the texts instead. The block must not print on standard output.
    """
    if not sys.stderr.isatty():

        def show_plainly(what: str, share: float | None = None) -> None:
            if otherwise is not None:
                otherwise(what)

        yield show_plainly
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (BarColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True, redirect_stdout=False) as bar:
        task = bar.add_task("", total=None)

        def show(what: str, share: float | None = None) -> None:
            bar.update(task, description=what, total=None if share is None else 1.0, completed=share or 0.0)

        yield show


def takes_workers(function: _Command) -> _Command:
    """Add ``--workers`` and ``--cluster`` to a command; its function receives ``workers``."""

    @click.option(
        "--workers",
        "--jobs",
        "count",
        type=WholeNumber(-1),
        default=-1,
        metavar="N",
        callback=_check_worker_count,
        help="Number of worker processes on this computer; default: one per core.",
    )
    @click.option(
        "--cluster",
        metavar="ADDRESS",
        envvar="DASK_SCHEDULER_ADDRESS",
        show_envvar=True,
        help="Address of the scheduler of a Dask cluster to use instead of this computer, such as tcp://HOST:8786.",
    )
    @wraps(function)
    def run(*arguments: Any, count: int, cluster: str | None, **options: Any) -> Any:
        source_of = click.get_current_context().get_parameter_source
        if source_of("count") == source_of("cluster") == ParameterSource.COMMANDLINE:
            raise click.UsageError("--workers and --cluster cannot be combined: a cluster has its own workers")
        is_local = cluster is None or source_of("count") == ParameterSource.COMMANDLINE
        workers = Workers(None if count < 0 else count) if is_local else Workers(cluster=cluster)
        return function(*arguments, workers=workers, **options)

    return run  # type: ignore[return-value]


def _check_worker_count(_context: click.Context, _option: click.Parameter, value: int) -> int:
    if value == 0:
        raise click.BadParameter("0 workers cannot compute anything: specify 1 or more, or -1 for one per core")
    return value


@contextmanager
def executor_for(workers: Workers) -> "Iterator[Executor]":
    """Open the executor of a command, and print a notice if a cluster has no workers."""
    with open_executor(workers) as executor:
        if not getattr(executor, "has_workers", True):
            click.echo(
                (f"{workers.cluster} does not have any workers yet: the computation will start when a worker joins"),
                err=True,
            )
        yield executor


class DeviceName(click.Option):
    """The option ``--device``, whose help lists the devices; with ``only_moving``, those that move by themselves."""

    def __init__(self, *declarations: Any, only_moving: bool = False, **attributes: Any) -> None:
        super().__init__(*declarations, metavar="NAME", **attributes)
        self._only_moving = only_moving

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """Return the option and its help text with the devices."""
        from study_app.devices.registry import all_devices

        names = []
        for device in all_devices():
            if device.moves_by_itself or not self._only_moving:
                without = [] if device.argument_required else [device.name]
                names += [*without, f"{device.name}:{device.argument}"] if device.argument else without
        *first, last = names
        listed = f"{', '.join(first)} or {last}" if first else last
        own_help = self.help
        self.help = (
            f"{listed}; see liquid-study devices."
            if not own_help
            else f"{own_help} {listed}; see liquid-study devices."
        )
        try:
            return super().get_help_record(ctx)
        finally:
            self.help = own_help


class TakesDeviceOptions(click.Command):
    """A command that also accepts the options of all devices and passes them on as ``device_options``."""

    def invoke(self, ctx: click.Context) -> Any:
        """Call the function with its parameters and the used device options by name."""
        added = ctx.params.keys() - {parameter.name for parameter in self.params}
        values = {name.replace("_", "-"): ctx.params.pop(name) for name in sorted(added)}
        ctx.params["device_options"] = {name: value for name, value in values.items() if value is not None}
        return super().invoke(ctx)

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """Return the command's own options, and those of devices whose names differ from these."""
        from study_app.devices.registry import all_devices

        own = super().get_params(ctx)
        own_names = {parameter.name for parameter in own}
        options = {option.name: option for device in all_devices() for option in device.options}
        added = [
            click.Option(
                [f"--{option.name}", keyword],
                type=click.Path(path_type=Path) if option.file_filter else str,
                metavar="PATH" if option.file_filter else "TEXT",
                help=option.help,
            )
            for option in options.values()
            if (keyword := option.name.replace("-", "_")) not in own_names
        ]
        return [*own[:-1], *added, *own[-1:]]  # --help remains the last one
