"""The commands, which parse arguments, call one function and return an exit code.

Exit codes: 0 is success, 1 a bug (with traceback), 2 a mistake that the user can correct (one line), 3 a problem that
a check found. Each command imports what it needs when it runs, so ``--help`` loads neither Qt nor the compiler. Read
first: ``options`` (shared by the commands), ``study`` (run, rehearse, check) and ``data`` (verify, report, export).

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
SHOWN = 200  # how many letters of a wrong value a message repeats


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
    """Return a message with words truncated to `SHOWN` letters and unprintable letters escaped."""
    return re.sub(rf"(\S{{{SHOWN}}})\S+", r"\1…", "\n".join(map(printable, message.split("\n"))))


def _exit_at_once(exit_codes: list[int]) -> None:
    """End the process without freeing objects, if there is an exit code."""
    if exit_codes:
        try:
            logging.shutdown()
            sys.stdout.flush()
        finally:  # even if the output is closed or missing (program without a console)
            os._exit(exit_codes[0])


def main() -> None:
    """Run a command; report a user's mistake in one line with exit code 2, and log any other failure.

    After a signal, Qt's objects and Python's modules are not freed, which would take seconds under load.
    """
    exit_codes: list[int] = []
    atexit.register(_exit_at_once, exit_codes)  # registered first, so it is called last
    compute_in_one_thread()
    os.environ.setdefault(
        "PYDANTIC_DISABLE_PLUGINS", "__all__"
    )  # searching for these unused plug-ins would read every installed package
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # an old console may lack characters; pipes and files are UTF-8
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
            logging.getLogger(__name__).info("%s", error, exc_info=True)  # the terminal shows only the message
        click.echo(f"liquid-study: {_shorten_message(str(error))}", err=True)
        sys.exit(EXIT_USER_ERROR)
    except (Exception, SystemExit) as error:
        if isinstance(error, SystemExit) and explain_error(error) is error:
            raise
        if isinstance(error, OSError) and error.errno == errno.ENAMETOOLONG and error.filename:
            click.echo(f"liquid-study: {_shorten_message(str(error.filename))}: the file name is too long", err=True)
            sys.exit(EXIT_USER_ERROR)
        log = logging.getLogger(__name__)
        if (explained := explain_error(error)) is error:
            log.critical("a bug ended the program", exc_info=True)
            raise
        log.info("%s", explained, exc_info=True)  # the terminal shows only the message
        click.echo(f"liquid-study: {_shorten_message(str(explained))}", err=True)
        sys.exit(EXIT_USER_ERROR)
    code = code if isinstance(code, int) else 0
    if code > _BY_SIGNAL and (qt := sys.modules.get("PySide6.QtCore")):
        atexit.unregister(getattr(qt, "__moduleShutdown", print))
        exit_codes.append(code)
    sys.exit(code)
