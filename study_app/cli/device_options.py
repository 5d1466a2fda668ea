"""The option ``--device``, and the options that devices bring with them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click


class DeviceName(click.Option):
    """``--device``, whose help names the devices; ``only_moving`` names those that move by themselves."""

    def __init__(self, *declarations: Any, only_moving: bool = False, **attributes: Any) -> None:
        super().__init__(*declarations, metavar="NAME", **attributes)
        self._only_moving = only_moving

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """Return the names, and what the option says else."""
        from study_app.devices.registry import discover

        names = []
        for device in discover().devices:
            if device.moves_by_itself or not self._only_moving:
                bare = [] if device.argument_required else [device.name]
                names += [*bare, f"{device.name}:{device.argument}"] if device.argument else bare
        *first, last = names
        listed = f"{', '.join(first)} or {last}" if first else last
        known = self.help
        self.help = f"{listed}; see devices." if not known else f"{known} {listed}; see devices."
        try:
            return super().get_help_record(ctx)
        finally:
            self.help = known


class TakesDeviceOptions(click.Command):
    """A command that also takes the options of all devices; the function gets them as keywords."""

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """Return the command's own options, then those of the devices whose names are free."""
        from study_app.devices.registry import discover

        own = super().get_params(ctx)
        taken = {parameter.name for parameter in own}
        options = {option.name: option for device in discover().devices for option in device.options}
        added = [
            click.Option(
                [f"--{option.name}", keyword],
                type=click.Path(path_type=Path) if option.file_filter else str,
                metavar="PATH" if option.file_filter else "TEXT",
                help=option.help,
            )
            for option in options.values()
            if (keyword := option.name.replace("-", "_")) not in taken
        ]
        return [*own[:-1], *added, *own[-1:]]  # --help stays the last


def given(options: Mapping[str, str | Path | None]) -> dict[str, str | Path]:
    """Return the device options that were given, by their own names."""
    return {name.replace("_", "-"): value for name, value in options.items() if value is not None}
