"""The commands: parse arguments, call one function, return an exit code.

0 done · 1 a bug (with traceback) · 2 a mistake the user can correct (one line) · 3 a check found a problem.
Each command imports what it needs when it runs, so that ``--help`` loads neither Qt nor the compiler. Read ``options``
(what commands share), ``study`` (run, rehearse, check) and ``data`` (verify, report, export) first.

Reading order: options; data, demo, devices, evidence, model, power, study; reference.
"""

import atexit
import errno
import io
import logging
import os
import re
import sys

import click

from study_app import __version__
from study_app.cli import data, demo, evidence, model, power, study
from study_app.cli.devices import devices, outlets, plugins
from study_app.cli.options import EXIT_USER_ERROR, GroupedCommands, example_of, printable
from study_app.discovery import explain_error
from study_app.errors import PlugInError, StudyError, naming_the_extra
from study_app.workers.one_thread import compute_in_one_thread

_BY_SIGNAL = 128  # added to a signal's number
SHOWN = 200  # letters of a bad value that a message repeats


@click.group(cls=GroupedCommands, invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="liquid-study")
@click.pass_context
def commands(context: click.Context) -> None:
    """Run, record and analyse studies of how liquids feel.

    If no command is given, the home window opens. FILE is a protocol or scene file, or the name of a file in the
    workspace or of a shipped study (rek2024, physical_liquids, physical2, slime, viscosityjnd, delaydetect, delayjnd,
    forcedelay, thickness, demo). RESULTS is a study folder, or its name in the workspace. SESSION is a ses-NN folder,
    or a name listed by the sessions command.
    """
    from study_app.program_log import start_log

    start_log()
    if context.invoked_subcommand is None:
        from study_app import app

        context.exit(app.run_home_window())


for module in (demo, study, data, power, model, evidence):
    for command in vars(module).values():
        if isinstance(command, click.Command):
            commands.add_command(command)
for command in (devices, outlets, plugins):  # the module's other commands belong to the group devices
    commands.add_command(command)


def _shorten_message(message: str) -> str:
    """Return a message without unprintable letters, in which words longer than `SHOWN` letters are truncated."""
    return re.sub(rf"(\S{{{SHOWN}}})\S+", r"\1…", "\n".join(map(printable, message.split("\n"))))


def _exit_at_once(ended: list[int]) -> None:
    if ended:
        try:
            logging.shutdown()
            sys.stdout.flush()
        finally:  # also where the output is closed, or a windowed program has none
            os._exit(ended[0])


def main() -> None:
    """Run a command; report a user's mistake in one line with exit code 2, and log any other failure.

    A program ended by a signal does not free Qt's objects and Python's modules, which takes seconds under load.
    """
    ended: list[int] = []
    atexit.register(_exit_at_once, ended)  # registered first, so it is called last
    compute_in_one_thread()
    os.environ.setdefault(
        "PYDANTIC_DISABLE_PLUGINS", "__all__"
    )  # they are not used, and searching for them reads every package
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # an old console may lack a letter; a pipe or file is UTF-8
            stream.reconfigure(encoding=None if stream.isatty() else "utf-8", errors="backslashreplace")
    try:
        with naming_the_extra():
            code = commands.main(standalone_mode=False)
    except click.UsageError as error:
        command = error.ctx.command_path if error.ctx else "liquid-study"
        example = f"; example: {usage}" if error.ctx and (usage := example_of(error.ctx)) else ""
        click.echo(f"{command}: {_shorten_message(error.format_message())} (see {command} --help{example})", err=True)
        sys.exit(EXIT_USER_ERROR)
    except (click.Abort, KeyboardInterrupt):
        sys.exit(130)
    except StudyError as error:
        if isinstance(error, PlugInError):
            logging.getLogger(__name__).info("%s", error, exc_info=True)  # the terminal shows only the line
        click.echo(f"liquid-study: {_shorten_message(str(error))}", err=True)
        sys.exit(EXIT_USER_ERROR)
    except (Exception, SystemExit) as error:
        if isinstance(error, SystemExit) and explain_error(error) is error:
            raise
        if isinstance(error, OSError) and error.errno == errno.ENAMETOOLONG and error.filename:
            click.echo(f"liquid-study: {_shorten_message(str(error.filename))}: the file name is too long", err=True)
            sys.exit(EXIT_USER_ERROR)
        log = logging.getLogger(__name__)
        if (said := explain_error(error)) is error:
            log.critical("a bug ended the program", exc_info=True)
            raise
        log.info("%s", said, exc_info=True)  # only in the log: the terminal shows the line below
        click.echo(f"liquid-study: {_shorten_message(str(said))}", err=True)
        sys.exit(EXIT_USER_ERROR)
    code = code if isinstance(code, int) else 0
    if code > _BY_SIGNAL and (qt := sys.modules.get("PySide6.QtCore")):
        atexit.unregister(getattr(qt, "__moduleShutdown", print))
        ended.append(code)
    sys.exit(code)
