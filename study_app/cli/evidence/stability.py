"""The command that shows where the closed loop of liquid, servo, device and hand stays stable."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from study_app.cli.evidence import present
from study_app.cli.options import (
    ShowProgress,
    Target,
    echo_files,
    end_if,
    exclude_each_other,
    executor_for,
    prepare,
    progress,
    takes_workers,
)
from study_app.errors import StudyError
from study_app.workers.executors import Workers

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from study_app.evidence.table import Evidence


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
    from study_app.evidence.stability import stability_report as found
    from study_app.evidence.stability.case_groups import groups, some, sweep
    from study_app.evidence.stability.stability_cases import parse

    parts = {"withheld": withheld, "delivered": delivered, "velocity": velocity}
    exclude_each_other(to=to, case=line, table=table, delayed=delayed, only=only, **parts)
    prepare(to)
    if line is not None:
        case = parse(line)
        click.echo(str(case))
        verdicts = found.verdicts_on(case)
        click.echo("\n".join(found.in_words(verdict) for verdict in verdicts))
        end_if(not verdicts[-1].stable)
        return
    if table is not None:
        with progress() as show, executor_for(workers) as executor:
            limits = found.limits(executor, lambda done, of: show(f"{done} of {of} limits", done / of), table.name)
        present(limits, table.parent)
        return
    if delayed is not None:
        from study_app.evidence.stability import force_delay

        with progress() as show:
            entries = force_delay.measure(progress=lambda done: show(f"{done} delays"))
        present(force_delay.evidence(entries, delayed.name), delayed.parent)
        return
    if any(parts.values()):
        part = next(name for name, chosen in parts.items() if chosen)
        with progress() as show, executor_for(workers) as executor:
            measured = _measure(part, executor, show)
        present(measured, None)
        return
    chosen = groups(seed, cases) if only is None else tuple(it for it in groups(seed, cases) if only in it.name)
    if not chosen:
        names = ", ".join(group.name for group in groups(seed, cases))
        raise StudyError(f"no group has {only!r} in its name: there are {names}")
    with progress() as show, executor_for(workers) as executor:
        swept = found.run_sweep(
            some(sweep(seed), cases) if only is None else (),
            chosen,
            executor,
            lambda done, of: show(f"{done} of {of} verdicts", done / of),
        )
        show("comparing forces")
        compared = found.fidelities(executor=executor) if only is None else ()
    shown = found.evidence(swept, compared)
    click.echo(shown.text, nl=False)
    if to is not None:
        click.echo()
        echo_files(shown.write(to))
    if swept.unstable:
        click.echo("\nunstable with safety on; repeat one with --case:", err=True)
        click.echo("\n".join(str(verdict.case) for verdict in swept.unstable), err=True)
    end_if(swept.unstable)


def _measure(part: str, executor: Executor, show: ShowProgress) -> Evidence:
    """Return the evidence of one measurement of its own."""
    from study_app.evidence.stability import delivered_force, velocity, withheld_force

    if part == "velocity":
        return velocity.evidence(velocity.measure(lambda what: show(f"measuring {what}")))
    show(f"measuring the force {part}")
    if part == "withheld":
        return withheld_force.evidence(withheld_force.measure(executor=executor))
    return delivered_force.evidence(delivered_force.measure(executor=executor))
