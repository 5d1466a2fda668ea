"""The page Commands: every command with every option, in tables that render."""

import click

from study_app.cli import commands
from study_app.cli.reference import commands_markdown
from tests.program_text import printed


def leaves(command: click.Command, path: tuple[str, ...] = ()) -> dict[str, click.Command]:
    found = {" ".join(path): command}
    if isinstance(command, click.Group):
        for name, below in command.commands.items():
            found |= leaves(below, (*path, name))
    return found


def test_every_command_has_its_section_with_every_option() -> None:
    text = commands_markdown()
    parts = {part.split("\n", 1)[0]: part for part in text.split("\n### ")[1:]}
    every = leaves(commands)
    del every[""]
    assert set(parts) == set(every)
    for name, command in every.items():
        for parameter in command.params:
            if getattr(parameter, "hidden", False):  # an older name
                continue
            assert all(f"`{option}" in parts[name] for option in parameter.opts if option.startswith("-")), name


def test_rows_have_three_cells_and_no_internal_names() -> None:
    text = commands_markdown()
    rows = [line.replace("\\|", "") for line in text.splitlines() if line.startswith("|")]
    assert {row.count("|") for row in rows} == {4}
    assert "UNSET" not in text
    assert "INTEGER" not in text
    assert not printed(text)


def test_required_options_and_defaults_are_named() -> None:
    rows = commands_markdown().splitlines()
    assert any(row.startswith("| `--reason TEXT` | required |") for row in rows)
    assert any(row.startswith("| `--device NAME` | `mouse` |") for row in rows)
