"""The command that shows where the closed loop of liquid, servo, device and hand stays stable."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from study_app.cli.options import EXIT_FOUND, Target, exclude_each_other, executor_for, progress, takes_workers
from study_app.errors import StudyError
from study_app.workers.executors import Workers

if TYPE_CHECKING:
    from study_app.validation.stability.case_groups import Group
    from study_app.validation.stability.verdict import Verdict


@click.command()
@click.option("--to", type=Target(), metavar="DIR", help="Folder for table, map, unstable cases and summary.")
@click.option("--case", "line", metavar="LINE", help='Evaluate one case, such as "liquid=honey rate_hz=250 delay=4".')
@click.option(
    "--table", type=click.Path(path_type=Path), metavar="FILE", help="Only measure the table of slope limits."
)
@click.option("--withheld", is_flag=True, help="Only print the share of each liquid's force that safety withholds.")
@click.option("--delivered", is_flag=True, help="Only print the error of each liquid's force in the hand.")
@click.option(
    "--velocity",
    is_flag=True,
    help="Only print errors, noise, stable damping and computation time of the velocity estimators.",
)
@click.option(
    "--delayed",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Only measure how much of a delayed force is sent.",
)
@click.option(
    "--estimation",
    "estimated",
    type=click.IntRange(1),
    metavar="N",
    help="Only simulate N loops in which estimates are applied.",
)
@click.option("--seed", default="stability", show_default=True, help="Seed of the cases.")
@click.option("--cases", type=click.IntRange(1), metavar="N", help="Only simulate N cases of each group.")
@click.option(
    "--only", metavar="TEXT", help='Only simulate groups with this text in their name, such as "non-Newtonian".'
)
@takes_workers
def stability(
    to: Path | None,
    line: str | None,
    table: Path | None,
    withheld: bool,
    delivered: bool,
    velocity: bool,
    delayed: Path | None,
    estimated: int | None,
    seed: str,
    cases: int | None,
    only: str | None,
    workers: Workers,
) -> None:
    """Simulate thousands of closed loops with the safety layer off and on, and print the unstable ones.

    Each case has a liquid, a scale, a rate, a delay, an estimator, a device and a hand; further groups have a second
    model of hand and device, a wrong delay estimate, lost samples, releases in mid-stroke, and the driver of the Falcon
    with its emulator. Ends with exit code 3 if a case is unstable with the safety layer on.
    """
    from study_app.store.output_files import make_folder
    from study_app.validation.stability import stability_report as found
    from study_app.validation.stability.case_groups import groups, some, sweep
    from study_app.validation.stability.fidelity import fidelities
    from study_app.validation.stability.stability_cases import parse

    exclude_each_other(
        to=to,
        case=line,
        table=table,
        withheld=withheld,
        delivered=delivered,
        velocity=velocity,
        delayed=delayed,
        estimation=estimated,
        only=only,
    )
    if to is not None:
        make_folder(to)
    if line is not None:
        case = parse(line)
        click.echo(str(case))
        verdicts = found.verdicts_on(case)
        click.echo("\n".join(found.in_words(verdict) for verdict in verdicts))
        _end(verdicts[-1:])
        return
    if table is not None:
        with progress() as show, executor_for(workers) as executor:
            found.write_limits(table, executor, lambda done, of: show(f"{done} of {of} limits", done / of))
        click.echo(table)
        return
    if withheld:
        _print_withheld(workers)
        return
    if delivered:
        _print_delivered(workers)
        return
    if velocity:
        _print_velocity()
        return
    if delayed is not None:
        _write_delayed(delayed)
        return
    if estimated is not None:
        _print_estimated(estimated, workers)
        return
    with progress() as show, executor_for(workers) as executor:
        swept = found.run_sweep(
            some(sweep(seed), cases) if only is None else (),
            groups(seed, cases) if only is None else _named(groups(seed, cases), only),
            executor,
            lambda done, of: show(f"{done} of {of} verdicts", done / of),
        )
        show("comparing forces")
        compared = fidelities(executor=executor) if only is None else ()
    click.echo(found.summary(swept, compared) if only is None else found.group_table(swept))
    if to is not None:
        click.echo("\n" + "\n".join(str(file) for file in found.write(to, swept, compared)))
    if swept.unstable:
        click.echo("\nunstable with safety on; repeat one with --case:", err=True)
        click.echo("\n".join(str(verdict.case) for verdict in swept.unstable), err=True)
    _end(swept.unstable)


def _named(groups: Sequence[Group], text: str) -> tuple[Group, ...]:
    """Return the groups with a text in their name."""
    chosen = tuple(group for group in groups if text in group.name)
    if not chosen:
        names = ", ".join(group.name for group in groups)
        raise StudyError(f"no group has {text!r} in its name: there are {names}")
    return chosen


def _print_withheld(workers: Workers) -> None:
    """Print the shares of force withheld; end with 3 if a goal is not met."""
    from study_app.validation.stability.withheld_force import measure, report

    with progress() as show, executor_for(workers) as executor:
        show("measuring the force withheld")
        shares = measure(executor=executor)
    click.echo(report(shares))
    if not all(share.met for share in shares):
        click.get_current_context().exit(EXIT_FOUND)


def _print_delivered(workers: Workers) -> None:
    """Print the errors of the forces sent; end with 3 if a limit is missed."""
    from study_app.validation.stability.delivered_force import measure, report

    with progress() as show, executor_for(workers) as executor:
        show("measuring the force delivered")
        found = measure(executor=executor)
    click.echo(report(found))
    if not all(it.met for it in found):
        click.get_current_context().exit(EXIT_FOUND)


def _print_estimated(count: int, workers: Workers) -> None:
    """Print what became of loops in which estimates are applied; end with 3 if one became unstable."""
    from study_app.validation.online_estimation.applied_estimates import applied_cases, judge_all, report

    with progress() as show, executor_for(workers) as executor:
        show("applying estimates in closed loops")
        verdicts = judge_all(applied_cases(count), executor)
    click.echo(report(verdicts))
    if any(it.harmed for it in verdicts):
        click.get_current_context().exit(EXIT_FOUND)


def _print_velocity() -> None:
    """Print the measurements of the velocity estimators; end with 3 if the Kalman filter misses a limit."""
    from study_app.validation.velocity.criteria import measure, report

    with progress() as show:
        rows = measure(lambda what: show(f"measuring {what}"))
    click.echo(report(rows))
    if not all(row.met for row in rows):
        click.get_current_context().exit(EXIT_FOUND)


def _write_delayed(file: Path) -> None:
    """Write the table of delayed forces, and print the shares that are left."""
    from study_app.validation.stability import force_delay

    with progress() as show:
        found = force_delay.write(file, lambda done, of: show(f"{done} of {of} delays", done / of))
    click.echo(force_delay.report(found))
    click.echo(file)


def _end(verdicts: Sequence[Verdict]) -> None:
    """End with 3 if one of the verdicts is unstable."""
    if not all(verdict.stable for verdict in verdicts):
        click.get_current_context().exit(EXIT_FOUND)
