"""The command that sets what sessions on this machine send to other programs."""

from typing import Any

import click

OFF = "off"


@click.command()
@click.option("--markers", type=click.Choice((OFF, "on")), help="Markers of events over the Lab Streaming Layer (LSL).")
@click.option(
    "--samples",
    type=click.Choice((OFF, "single-blind", "always")),
    help="Samples over LSL; single-blind: not in double-blind studies.",
)
@click.option("--triggers", metavar="PORT", help="Trigger codes on a port, such as serial:/dev/ttyUSB0; off: none.")
def outlets(markers: str | None, samples: str | None, triggers: str | None) -> None:
    """Print what sessions on this machine send to other programs; with options, change it."""
    from study_app.errors import OutletError
    from study_app.outlets.session_outlets import is_port, port_examples
    from study_app.store import workstation

    settings = workstation.load()
    changes: dict[str, Any] = {} if markers is None else {"lsl_markers": markers == "on"}
    if samples is not None:
        changes["lsl_samples"] = samples
    if triggers is not None:
        changes["triggers"] = "" if triggers == OFF else triggers
        if triggers != OFF and not is_port(triggers):
            examples = " or ".join(port_examples())
            raise OutletError(f"--triggers '{triggers}' is not the address of a port: use one like {examples}, or off")
    if changes:
        settings = type(settings).model_validate(settings.model_dump() | changes)
        workstation.save(settings)
    click.echo(f"markers over LSL: {'on' if settings.lsl_markers else OFF}")
    click.echo(f"samples over LSL: {settings.lsl_samples}")
    click.echo(f"triggers: {settings.triggers or OFF}")
