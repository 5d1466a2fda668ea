"""Pages of the documentation that are generated from the program: commands, kinds of study elements, delayed force."""

import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import click

from study_app.cli import commands
from study_app.cli.options import GROUPS
from study_app.designer.new_study_page import TEMPLATES
from study_app.devices.descriptors import DEVICES
from study_app.haptics.model.effects import EFFECTS
from study_app.haptics.model.layout import LIMITERS
from study_app.outlets.markers import CODES
from study_app.protocol import questions
from study_app.protocol.questionnaires import Instrument
from study_app.protocol.trials import DESIGN_KINDS, METHOD_KINDS
from study_app.protocol.warnings import longest_delay_ms, stored_table

_PROGRAM = "liquid-study"
_LEAST_DELAY_MS = 10
_LOOPS = (("kalman", "light"), ("ewma", "light"), ("kalman", "middle"), ("kalman", "firm"))
_DEVICE_KINDS = {"felt": "with force", "seen": "without force", "simulated": "simulated: the hand moves by itself"}


def kinds_markdown() -> str:
    """Return Markdown tables of the kinds of study elements, devices, limiters and templates."""
    tables = (
        ("Questions", ("`kind`", "question", "additional keys", "value in the tables"), _question_rows()),
        ("Standard questionnaires", ("`instrument`", "texts", "scores", "source and comparison"), _instrument_rows()),
        ("Designs", ("`kind`", "question or answer"), _kind_descriptions(DESIGN_KINDS)),
        ("Methods", ("`kind`", "next level"), _kind_descriptions(METHOD_KINDS)),
        ("Effects", ("effect", "description", "`auto`", "not with"), _effect_rows()),
        ("Limiters", ("bit", "limiter", "column", "meaning"), _limiter_rows()),
        ("Trigger codes", ("code", "journal event"), ((str(code), f"`{name}`") for name, code in CODES.items())),
        ("Devices", ("`--device`", "device", "kind", "options"), _device_rows()),
        ("Checks of a device, in order", ("`devices doctor`", "symptom if it fails", "cause; remedy"), _check_rows()),
        (
            "Templates",
            ("`--template`", "title", "question"),
            ((f"`{name}`", *description) for name, description in TEMPLATES.items()),
        ),
    )
    return "\n".join(line for heading, columns, rows in tables for line in _table_lines(heading, columns, rows))


def delayed_force_markdown() -> str:
    """Return Markdown tables of the delivered proportion of a delayed force and the longest delay with 95 %."""
    entries = [entry for entry in stored_table() if entry.estimator == "kalman"]
    delays = [delay for delay in sorted({entry.delay_ms for entry in entries}) if delay >= _LEAST_DELAY_MS]
    remaining = {(entry.liquid, entry.hand, entry.delay_ms): f"{entry.left_percent:.0f}" for entry in entries}
    liquids = dict.fromkeys(entry.liquid for entry in entries)
    labels = {liquid: liquid.replace("physical2_", "`physical2`: ").replace("_", " ") for liquid in liquids}
    shares = (
        (labels[name], *(f"{remaining[name, 'light', delay]} ({remaining[name, 'middle', delay]})" for delay in delays))
        for name in liquids
    )
    longest = ((labels[name], *(f"{longest_delay_ms(name, *loop):g}" for loop in _LOOPS)) for name in liquids)
    tables = (
        (
            "Remaining force [%], light grip (medium grip in brackets), `kalman`",
            ("liquid", *(f"{delay:g} ms" for delay in delays)),
            shares,
        ),
        ("Longest delay [ms] at which at most 5 % is held back", ("liquid", *map(", ".join, _LOOPS)), longest),
    )
    return "\n".join(line for heading, columns, rows in tables for line in _table_lines(heading, columns, rows))


def _table_lines(heading: str, columns: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> Iterator[str]:
    yield from (f"## {heading}", "", f"| {' | '.join(columns)} |", f"|{' --- |' * len(columns)}")
    yield from (f"| {' | '.join(map(_cell, row))} |" for row in rows)
    yield ""


def _kind_descriptions(kinds: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    return ((f"`{name}`", " ".join((kind.__doc__ or "").split())) for name, kind in kinds.items())


def _question_rows() -> Iterator[tuple[str, ...]]:
    common = {*questions.Question.model_fields, "kind"}
    for name, description in _kind_descriptions(questions.KINDS):
        kind = questions.KINDS[name.strip("`")]
        keys = (field.alias or key for key, field in kind.model_fields.items() if key not in common)
        label = "no `kind`" if name == f"`{questions.STATEMENT}`" else name
        yield label, description, ", ".join(f"`{key}`" for key in keys), kind.value_type


def _instrument_rows() -> Iterator[tuple[str, ...]]:
    for name in Instrument.names():
        table = Instrument(name).table
        caveat = f"; from memory: {table['from_memory']}" if "from_memory" in table else ""
        scores = ", ".join(f"`{score}`" for score in table["scores"])
        texts = ", ".join(table["languages"]) or "yours"
        yield f"`{name}`", texts, scores, f"{table['source']}. Compared: {table['compared']}{caveat}"


def _effect_rows() -> Iterator[tuple[str, ...]]:
    for effect in EFFECTS:
        description = sys.modules[effect.bound_n.__module__].__doc__ or ""
        excluded = ", ".join(f"`{name}`" for name in effect.excludes)
        yield f"`{effect.name}`", description, "yes" if effect.automatic else "no", excluded


def _limiter_rows() -> Iterator[tuple[str, ...]]:
    for limiter in sorted(LIMITERS):
        yield str(limiter.bit), limiter.label, f"`limiter_{limiter.name}`", limiter.meaning


def _device_rows() -> Iterator[tuple[str, ...]]:
    for device in DEVICES:
        options = ", ".join(f"`--{option.name}`" for option in device.options)
        yield f"`{device.name}`", device.title, _DEVICE_KINDS[device.kind], options


def _check_rows() -> Iterator[tuple[str, ...]]:
    for device in DEVICES:
        for finding in device.doctor.findings() if device.doctor and device.kind != "simulated" else ():
            yield (
                f"`{device.name}` {finding.number}: {finding.tested}",
                finding.symptom,
                f"{finding.cause}; {finding.cure}",
            )


def commands_markdown() -> str:
    """Return every command by group, with its arguments and options, as Markdown."""
    lines: list[str] = []
    for heading, names in GROUPS.items():
        lines += [f"## {heading}", ""]
        for name in names.split():
            for path, command in _with_subcommands((_PROGRAM, name), commands.commands[name]):
                lines += [*_command_lines(path, command), ""]
    return "\n".join(lines)


def _with_subcommands(path: tuple[str, ...], command: click.Command) -> Iterator[tuple[tuple[str, ...], click.Command]]:
    yield path, command
    if isinstance(command, click.Group):
        for name, subcommand in command.commands.items():
            yield from _with_subcommands((*path, name), subcommand)


def _command_lines(path: tuple[str, ...], command: click.Command) -> Iterator[str]:
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
        yield from (_option_row(option, context) for option in options)


def _paragraphs(text: str) -> list[str]:
    lines = "\n".join(line.strip() for line in text.strip().splitlines())
    return [_cell(paragraph) for paragraph in lines.split("\n\n")]


def _option_row(option: click.Option, context: click.Context) -> str:
    placeholder = option.metavar or re.sub(r"(INTEGER|FLOAT)( RANGE)?", "N", option.make_metavar(context))
    metavar = "" if option.is_flag else f" {placeholder}"
    names = ", ".join(f"`{name}{metavar}`" for name in option.opts).replace("|", "\\|")
    default = option.get_default(context, call=False)
    text = "" if option.is_flag or option.multiple or callable(default) else str(default)
    value = "required" if option.required else f"`{text}`" if text and "UNSET" not in text and text != "None" else ""
    return f"| {names} | {value} | {_cell(option.help or '')} |"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "\\<").replace("*", "\\*").replace("``", "`")
