"""The command that shows where the closed loop of liquid, servo, device and hand stays stable."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from study_app.cli.options import EXIT_FOUND, Target

if TYPE_CHECKING:
    from study_app.validation.stability.verdict import Verdict


@click.command()
@click.option("--to", type=Target(), metavar="DIR", help="Write table, map, failing cases, summary.")
@click.option(
    "--case", "line", metavar="LINE", help='Judge one case alone, such as "liquid=honey rate_hz=250 delay=4".'
)
@click.option(
    "--table", type=click.Path(path_type=Path), metavar="FILE", help="Only measure the table of slope limits."
)
@click.option("--withheld", is_flag=True, help="Only the share of each liquid's force that safety withholds.")
@click.option("--seed", default="stability", show_default=True, help="What the cases are drawn from.")
@click.option("--cases", type=click.IntRange(1), metavar="N", help="Only N cases of each group.")
def stability(
    to: Path | None, line: str | None, table: Path | None, withheld: bool, seed: str, cases: int | None
) -> None:
    """Simulate thousands of closed loops with the safety layer off and on, and print which are unstable.

    Each has a liquid, a scale, a rate, a delay, an estimator, a device and a hand; further groups have a second model
    of hand and device, a delay that is misjudged, lost samples, releases in mid-stroke, and the driver of the Falcon in
    front of its emulator. Ends with 3 if one is unstable with safety on.
    """
    from study_app.validation.stability import sweep as found
    from study_app.validation.stability.case_groups import groups, some, sweep
    from study_app.validation.stability.fidelity import fidelities
    from study_app.validation.stability.stability_cases import parse

    if line is not None:
        case = parse(line)
        click.echo(str(case))
        verdicts = found.verdicts_on(case)
        click.echo("\n".join(found.in_words(verdict) for verdict in verdicts))
        _end(verdicts[-1:])
        return
    if table is not None:
        found.write_limits(table, _progress("limits"))
        click.echo(table)
        return
    if withheld:
        _print_withheld()
        return
    swept = found.run_sweep(some(sweep(seed), cases), groups(seed, cases), _progress("verdicts"))
    compared = fidelities()
    click.echo(found.summary(swept, compared))
    if to is not None:
        click.echo("\n" + "\n".join(str(file) for file in found.write(to, swept, compared)))
    if swept.unstable:
        click.echo("\nunstable with safety on; each again by --case:", err=True)
        click.echo("\n".join(str(verdict.case) for verdict in swept.unstable), err=True)
    _end(swept.unstable)


def _print_withheld() -> None:
    """Print the shares of force withheld; end with 3 if a goal is not met."""
    from study_app.validation.stability.withheld_force import measure, report

    shares = measure()
    click.echo(report(shares))
    if not all(share.met for share in shares):
        click.get_current_context().exit(EXIT_FOUND)


def _end(verdicts: Sequence[Verdict]) -> None:
    """End with 3 if one of the verdicts is unstable."""
    if not all(verdict.stable for verdict in verdicts):
        click.get_current_context().exit(EXIT_FOUND)


def _progress(what: str) -> Callable[[int, int], None] | None:
    """Return what shows on one line of a terminal how far it is, None where nobody looks."""
    if not sys.stderr.isatty():
        return None

    def show(done: int, of: int) -> None:
        click.echo(f"\r{done} of {of} {what}" + ("\n" if done == of else ""), nl=False, err=True)

    return show
