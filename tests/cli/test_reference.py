"""The page Commands: every command with every option, in tables that render."""

import click

from study_app.cli.reference import commands_markdown


def leaves(command: click.Command, path: tuple[str, ...] = ()) -> dict[str, click.Command]:
    found = {" ".join(path): command}
    if isinstance(command, click.Group):
        for name, below in command.commands.items():
            found |= leaves(below, (*path, name))
    return found


def test_required_options_and_defaults_are_named() -> None:
    rows = commands_markdown().splitlines()
    assert any(row.startswith("| `--reason TEXT` | required |") for row in rows)
    assert any(row.startswith("| `--device NAME` | `mouse` |") for row in rows)
