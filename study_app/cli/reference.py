"""The commands as text: the page Commands of the documentation, made from the commands themselves."""

import re
from collections.abc import Iterator

import click

from study_app.cli import commands
from study_app.cli.options import GROUPS

PROGRAM = "liquid-study"


def commands_markdown() -> str:
    """Return every command by group, with its arguments and options, as Markdown."""
    lines: list[str] = []
    for heading, names in GROUPS.items():
        lines += [f"## {heading}", ""]
        for name in names.split():
            for path, command in _with_subcommands((PROGRAM, name), commands.commands[name]):
                lines += [*_command(path, command), ""]
    return "\n".join(lines)


def _with_subcommands(path: tuple[str, ...], command: click.Command) -> Iterator[tuple[tuple[str, ...], click.Command]]:
    yield path, command
    if isinstance(command, click.Group):
        for name, below in command.commands.items():
            yield from _with_subcommands((*path, name), below)


def _command(path: tuple[str, ...], command: click.Command) -> Iterator[str]:
    context = click.Context(command, info_name=" ".join(path))
    yield f"### {' '.join(path[1:])}"
    yield ""
    yield f"`{' '.join([' '.join(path), *command.collect_usage_pieces(context)])}`"
    yield ""
    yield from (paragraph.replace("\n", " ") + "\n" for paragraph in _paragraphs(command.help or ""))
    options = [option for option in command.params if isinstance(option, click.Option) and not option.hidden]
    if options:
        yield "| option | default | meaning |"
        yield "| --- | --- | --- |"
        yield from (_option(option, context) for option in options)


def _paragraphs(text: str) -> list[str]:
    lines = "\n".join(line.strip() for line in text.strip().splitlines())
    return [_cell(paragraph) for paragraph in lines.split("\n\n")]


def _option(option: click.Option, context: click.Context) -> str:
    named = option.metavar or re.sub(r"(INTEGER|FLOAT)( RANGE)?", "N", option.make_metavar(context))
    metavar = "" if option.is_flag else f" {named}"
    names = ", ".join(f"`{name}{metavar}`" for name in option.opts).replace("|", "\\|")
    default = option.get_default(context, call=False)
    shown = "" if option.is_flag or option.multiple or callable(default) else str(default)
    words = (
        "required" if option.required else f"`{shown}`" if shown and "UNSET" not in shown and shown != "None" else ""
    )
    return f"| {names} | {words} | {_cell(option.help or '')} |"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "\\<").replace("*", "\\*").replace("``", "`")
