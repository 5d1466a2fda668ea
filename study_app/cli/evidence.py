"""The commands that print evidence: accuracy of the force model, stability, timing, and rates of the analysis."""

from __future__ import annotations

import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Final

import click

from study_app.cli.options import (
    ShowProgress,
    Target,
    WholeNumber,
    echo_files,
    exclude_each_other,
    executor_for,
    exit_if,
    make_output_folder,
    progress,
    takes_workers,
)
from study_app.errors import DisplayError, StudyError
from study_app.workers.executors import Workers

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from study_app.app.delay_session import WindowsThread
    from study_app.evidence.computer import LoadName
    from study_app.evidence.table import Evidence
    from study_app.haptics.model.motion import Motion
    from study_app.haptics.model.scene import Scene

_EXIT_UNDECIDED = 4


def _present_evidence(result: Evidence, to: Path | None, *, with_text: bool = True) -> None:
    """Print evidence, and write it to the folder ``to``, if given; without ``with_text``, only do one of the two.

    The exit code is 3 if a limit is missed, otherwise 4 if one is undecided.
    """
    if with_text or to is None:
        click.echo(result.text, nl=False)
    if to is not None:
        echo_files(result.write(to))
    if result.closing:
        click.echo(result.closing)
    exit_if(result.missed)
    if result.undecided:
        click.get_current_context().exit(_EXIT_UNDECIDED)


_DEFAULT_PATH = "stir"
_REAL = "physical2"


@click.command()
@click.argument("scene", metavar="[FILE]", required=False)
@click.option("--liquid", metavar="NAME", help="Name of the liquid; default: water in rek2024, and honey in physical2.")
@click.option(
    "--path",
    default=_DEFAULT_PATH,
    show_default=True,
    metavar="PATH",
    help="CSV file with a motion, or a programmed path: stir, circle, reverse, reach …",
)
@click.option(
    "--liquids",
    "every",
    is_flag=True,
    help=(
        "Instead, print the force error, speed range and computation time per tick for each liquid in FILE (default: "
        "physical2), using the liquid's own model."
    ),
)
@click.option(
    "--to", type=Target(), metavar="DIR", help="Folder for the table and the figure; default: print the table."
)
def accuracy(scene: str | None, liquid: str | None, path: str, to: Path | None, *, every: bool) -> None:
    """Compare the accuracy and computation time of the models of a liquid.

    FILE is a protocol or scene file; default: rek2024 and physical2. Wakes are compared with exact sums; models of real
    liquids are compared with experiments, exact solutions and a fluid solver.
    """
    if every:
        exclude_each_other(liquids=every, liquid=liquid)
        exclude_each_other(liquids=every, path=None if path == _DEFAULT_PATH else path)
        _print_survey(scene, to)
        return
    from study_app.evidence.accuracy import accuracy as measure
    from study_app.evidence.accuracy import accuracy_evidence

    numerical, physical, notes = _scenes_to_compare(scene, liquid)
    subject = numerical or physical
    motion = _motion_along(path, subject) if subject is not None else None
    if motion is None:
        raise click.UsageError(f"nothing can be measured: {'; '.join(notes)}")
    make_output_folder(to)
    name = "stirring" if path == _DEFAULT_PATH else path
    with progress(lambda text: click.echo(f"{text}…", err=True)) as show:
        measured = measure(numerical, physical, motion, named=name, notes=notes, progress=show)
    _present_evidence(accuracy_evidence(measured), to, with_text=False)


def _print_survey(file: str | None, to: Path | None) -> None:
    """Print or write the force error of every liquid in a file."""
    from study_app.evidence.accuracy import survey_evidence, survey_scenes
    from study_app.protocol.load import load_scenes

    make_output_folder(to)
    scenes = load_scenes(file or _REAL)
    with progress(lambda text: click.echo(f"{text}…", err=True)) as show:
        errors = survey_scenes(scenes, show)
    if not errors:
        raise click.UsageError(
            f"{file} does not specify the viscosity of any liquid, so there is no physical reference"
        )
    if omitted := [name for name in scenes if name not in {surveyed.liquid for surveyed in errors}]:
        click.echo(f"not compared, because references need a constant viscosity: {', '.join(omitted)}", err=True)
    _present_evidence(survey_evidence(errors), to, with_text=False)


def _scenes_to_compare(scene: str | None, liquid: str | None) -> tuple[Scene | None, Scene | None, tuple[str, ...]]:
    """Return the scene whose force is compared, the scene of a real liquid, and notes on a missing one."""
    from study_app.protocol.load import load_scene, load_scenes

    if scene is None and liquid is None:
        return load_scene("rek2024", "water"), load_scene(_REAL, "honey"), ()
    if scene is None:
        thesis, real = load_scenes("rek2024"), load_scenes(_REAL)
        if liquid in thesis or liquid in real:
            return thesis.get(liquid or ""), real.get(liquid or ""), ()
        known = ", ".join(dict.fromkeys([*thesis, *real]))
        raise click.UsageError(
            f"--liquid {liquid}: the known liquids are {known}; to use another liquid, specify the FILE that contains "
            "it"
        )
    if liquid is None:
        scenes = load_scenes(scene)
        if len(scenes) > 1:
            raise click.UsageError(f"{scene} contains several liquids: specify one with --liquid ({', '.join(scenes)})")
        liquid = next(iter(scenes))
    chosen = load_scene(scene, liquid)
    if chosen.liquids[0].viscosity_pa_s is None:
        return chosen, None, (f"the viscosity of {liquid} is not specified, so there is no physical reference",)
    if chosen.liquids[0].drag.law == "linear":
        return chosen, None, (f"{liquid} is a linear damper, so there is no physical reference",)
    return chosen, chosen, ()


def _motion_along(path: str, scene: Scene) -> Motion:
    """Return a programmed motion or that of a file, at the scene's rate."""
    from study_app.evidence.reference_solutions import stirring_motion
    from study_app.haptics.model import motion
    from study_app.lab.identify.measured_force import at_rate

    if path == _DEFAULT_PATH:
        return stirring_motion(scene.scale, scene.rate_hz)
    is_programmed = path in motion.NAMES or not (Path(path).suffix or Path(path).exists())
    return (
        motion.programmed_motion(path, rate_hz=scene.rate_hz)
        if is_programmed
        else at_rate(motion.read_motion(Path(path)), scene.rate_hz)
    )


@click.command()
@click.option(
    "--solve",
    is_flag=True,
    help=(
        "Compute the flow again instead of using the stored tables (20 minutes on an idle core, an hour on a busy "
        "one); requires the cfd extra (NGSolve, 350 MB)."
    ),
)
@click.option(
    "--refit",
    is_flag=True,
    help=(
        "Fit the unsteady-drag constants to the stored motions, and print the error for every motion, including those "
        "not used in the fit; this takes about two minutes."
    ),
)
@click.option(
    "--to", type=Target(), metavar="DIR", help="Folder for the tables and the figure; default: print the tables."
)
@click.option(
    "--materials",
    is_flag=True,
    help="Compare only the drag in Herschel–Bulkley liquids; with --solve this takes half an hour.",
)
@click.option(
    "--score",
    is_flag=True,
    help=(
        "Run the benchmark for force engines (error, time, energy supplied, tolerated delay) on this program's "
        "models; this takes about five minutes."
    ),
)
@takes_workers
def cfd(to: Path | None, workers: Workers, *, solve: bool, refit: bool, materials: bool, score: bool) -> None:
    """Fit models of honey and glycerin to the forces computed by a fluid solver, and report the residual error.

    A 68 mm ball starts, moves at a constant speed of 0.2 or 0.6 m/s, and stops abruptly. Fitting takes about a minute.
    --refit also uses other motions, such as oscillations and a reversal.
    """
    from study_app.evidence.cfd import (
        fit_all,
        fits_evidence,
        held_out,
        law_fit_evidence,
        load_steady,
        load_tables,
        refit_law,
        score_all,
        training,
    )
    from study_app.evidence.cfd import solve as solve_all

    exclude_each_other(refit=refit, materials=materials, score=score)
    exclude_each_other(solve=solve, score=score)
    if solve and to is None:
        raise click.UsageError("--solve needs --to, the folder for the solver's tables")
    make_output_folder(to)
    if score:
        with progress(lambda text: click.echo(text, err=True)) as show:
            scored = score_all(show)
        _present_evidence(scored, to)
        return
    if materials:
        _print_material_errors(to, workers, solve=solve)
        return
    with progress(lambda text: click.echo(text, err=True)) as show:
        solved: tuple[Path, ...] = ()
        if solve and to is not None:
            with executor_for(workers) as executor:
                solved = solve_all(to, executor, show)
        source = to if solve else None
        tables, drag = load_tables(source), load_steady(source)
        if refit:
            result = law_fit_evidence(refit_law((*tables, *training(source)), held_out(source), show))
        else:
            result = fits_evidence(tables, drag, fit_all(tables, show))
    echo_files(solved)
    _present_evidence(result, to, with_text=False)


def _print_material_errors(to: Path | None, workers: Workers, *, solve: bool) -> None:
    """Print or write the drag law's error in Herschel–Bulkley liquids, with the stored table or a new one."""
    from study_app.evidence.cfd import solve_materials, stored_materials, yield_flow_evidence

    if solve and to is not None:
        with progress(lambda text: click.echo(text, err=True)) as show, executor_for(workers) as executor:
            click.echo(solve_materials(to, executor, show))
    _present_evidence(yield_flow_evidence(stored_materials(to if solve else None)), to, with_text=False)


@click.command()
@click.option("--to", type=Target(), metavar="DIR", help="Folder for the table, map, unstable cases and summary.")
@click.option("--case", "line", metavar="LINE", help='Evaluate one case, such as "liquid=honey rate_hz=250 delay=4".')
@click.option(
    "--table",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Measure only the slope limits, and write them to FILE.",
)
@click.option(
    "--withheld",
    is_flag=True,
    help="Print only the proportion of each liquid's force that the safety layer holds back.",
)
@click.option(
    "--delivered",
    is_flag=True,
    help="Print only the error of the force on the hand, and whether it is within its limits; this takes a minute.",
)
@click.option(
    "--whole",
    is_flag=True,
    help="With --delivered, also evaluate all combinations of hand and handle, and the liquids of all shipped studies.",
)
@click.option(
    "--velocity",
    is_flag=True,
    help="Print only the errors, noise, stable damping and computation time of the velocity estimators.",
)
@click.option(
    "--delayed",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Measure only the proportion of a delayed force that the safety layer lets through, and write it to FILE.",
)
@click.option(
    "--seed", help="Seed for the cases. Specify a seed to repeat a run; default: a new seed, which is printed."
)
@click.option("--cases", type=WholeNumber(1), metavar="N", help="Simulate only N cases from each group.")
@click.option("--only", metavar="TEXT", help='Simulate only groups whose names contain TEXT, such as "non-Newtonian".')
@takes_workers
def stability(
    to: Path | None,
    line: str | None,
    table: Path | None,
    withheld: bool,
    delivered: bool,
    whole: bool,
    velocity: bool,
    delayed: Path | None,
    seed: str | None,
    cases: int | None,
    only: str | None,
    workers: Workers,
) -> None:
    """Simulate thousands of closed loops with the safety layer off and on, and print the unstable and noisy ones.

    Each case combines a liquid, a scale, a rate, a delay, an estimator, a device and a hand. Additional groups test a
    second model of the hand and the device, a wrong delay estimate, lost samples, releases mid-stroke, and the Falcon's
    driver with an emulated Falcon. The exit code is 3 if a case is unstable with the safety layer on, or if more than 1
    in 10,000 cases are noisy.
    """
    from study_app.evidence.stability import (
        NOISY,
        UNSTABLE,
        evenly_chosen,
        fidelities,
        groups,
        parse_case,
        run_sweep,
        slope_limits_evidence,
        stability_evidence,
        sweep,
        verdict_text,
        verdicts_on,
    )

    parts = {"withheld": withheld, "delivered": delivered, "velocity": velocity}
    exclude_each_other(to=to, case=line, table=table, delayed=delayed, only=only, **parts)
    if whole and not delivered:
        raise click.UsageError("--whole extends the table printed by --delivered, so add --delivered")
    make_output_folder(to)
    if line is not None:
        case = parse_case(line)
        click.echo(str(case))
        verdicts = verdicts_on(case)
        click.echo("\n".join(verdict_text(verdict) for verdict in verdicts))
        exit_if(verdicts[-1].reasons)
        return
    if table is not None:
        with progress() as show, executor_for(workers) as executor:
            limits = slope_limits_evidence(
                executor, lambda done, of: show(f"{done} of {of} limits", done / of), table.name
            )
        _present_evidence(limits, table.parent)
        return
    if delayed is not None:
        from study_app.evidence.stability import force_delay_evidence, measure_force_delays

        with progress() as show:
            entries = measure_force_delays(progress=lambda done: show(f"{done} delays"))
        _present_evidence(force_delay_evidence(entries, delayed.name), delayed.parent)
        return
    if any(parts.values()):
        part = next(name for name, chosen in parts.items() if chosen)
        with progress() as show, executor_for(workers) as executor:
            measured = _measure_part(part, executor, show, whole=whole)
        _present_evidence(measured, None)
        return
    seed = seed or os.urandom(4).hex()
    chosen = tuple(group for group in groups(seed, cases) if only is None or only in group.name)
    if not chosen:
        names = ", ".join(f'"{group.name}"' for group in groups(seed, cases))
        raise StudyError(f"no group has a name that contains {only!r}; choose from: {names}")
    with progress() as show, executor_for(workers) as executor:
        swept = run_sweep(
            evenly_chosen(sweep(seed), cases) if only is None else (),
            chosen,
            executor,
            lambda done, of: show(f"{done} of {of} verdicts", done / of),
        )
        show("comparing forces")
        compared = fidelities(executor=executor) if only is None else ()
    evidence = stability_evidence(swept, compared, seed)
    click.echo(evidence.text, nl=False)
    if to is not None:
        click.echo()
        echo_files(evidence.write(to))
    for grade in (UNSTABLE, NOISY):
        if flagged := swept.of_grade(grade):
            click.echo(f"\n{grade} with safety on; to repeat a case, use --case:", err=True)
            click.echo("\n".join(str(verdict.case) for verdict in flagged), err=True)
    exit_if(swept.missed)


def _measure_part(part: str, executor: Executor, show: ShowProgress, *, whole: bool) -> Evidence:
    """Return the evidence from one of the separate measurements."""
    from study_app.evidence.stability import (
        delivered_force_evidence,
        measure_delivered_force,
        measure_velocities,
        measure_withheld_force,
        velocity_evidence,
        withheld_force_evidence,
    )

    if part == "velocity":
        return velocity_evidence(measure_velocities(lambda what: show(f"measuring {what}")))
    show(f"measuring the force {part}")
    if part == "withheld":
        return withheld_force_evidence(measure_withheld_force(executor=executor))
    return delivered_force_evidence(measure_delivered_force(whole=whole, executor=executor))


_MAX_COMPARISON_S = 300.0
_LOAD = click.Choice(("none", "gui", "gui+cpu"))


@click.command()
@click.option(
    "--seconds",
    type=float,
    default=10.0,
    show_default=True,
    metavar="S",
    help="Measurement time for each loop or delay.",
)
@click.option(
    "--load",
    type=_LOAD,
    default="none",
    show_default=True,
    help="gui: paint both windows; gui+cpu: also keep all cores busy.",
)
@click.option(
    "--spin", "spin_us", type=float, metavar="US", help="Time for which the clock is polled before each deadline [µs]."
)
@click.option("--delays", "of_delays", is_flag=True, help="Measure the delay of the participant's picture instead.")
@click.option(
    "--devices",
    "of_devices",
    is_flag=True,
    help="Compare the lateness of each emulated device and the scripted hand instead.",
)
@click.option("--lsl", is_flag=True, help="Measure Lab Streaming Layer (LSL) streams instead.")
@click.option(
    "--triggers",
    metavar="PORT",
    help="Measure triggers on a port instead, such as serial:/dev/ttyUSB0; virtual uses a pair of virtual ports.",
)
@click.option("--to", type=Target(), metavar="DIR", help="Folder for the tables and the figure.")
def timing(
    seconds: float,
    load: LoadName,
    spin_us: float | None,
    of_delays: bool,
    of_devices: bool,
    lsl: bool,
    triggers: str | None,
    to: Path | None,
) -> None:
    """Measure the lateness of the servo, a bare compiled loop, a Python thread and a Qt timer.

    The measurement switches among the four loops every quarter of a second, in each priority class that the system
    grants. Ctrl+C ends the command.

    With --delays, a session presents the delays of rek2024 on 60 and 144 Hz screens, with and without load, and the
    error of every frame's delay is computed from the session's recordings. No display is needed.

    With --devices, the servo runs alternately with each emulated device and with the scripted hand. The exit code is 3
    if, for any device, the 99th percentile of the lateness is more than 1.5 times the value for the scripted hand, and
    the whole 95 % interval for this ratio lies above 1.5.

    With --lsl, another process first receives markers and 1 kHz samples for the given time; then the servo runs
    alternately with and without both streams, for up to 300 s each. The exit code is 3 if anything is lost, if a
    marker's time differs from the servo's clock by more than 1 ms, or if the median lateness increases by more than
    10 %.

    With --triggers, the command sends a byte to a port for each event, and measures the delay.
    """
    from study_app.evidence.computer import under_load
    from study_app.evidence.table import check_seconds

    others = {"delays": of_delays, "devices": of_devices, "lsl": lsl, "triggers": triggers}
    exclude_each_other(**others)
    other = next((name for name, is_requested in others.items() if is_requested), "")
    if other and spin_us is not None:
        raise StudyError(f"--spin applies only to the servo's loops: omit it with --{other}")
    if other in {"lsl", "triggers"}:
        check_seconds(seconds, "outlets can be measured")
    if other == "delays":
        _choose_display()
    make_output_folder(to)

    def measure_other(ending: threading.Event, show: ShowProgress) -> Evidence:
        if other == "devices":
            from study_app.evidence.timing import emulated_devices, lateness_evidence, time_devices

            names = emulated_devices()
            return lateness_evidence(time_devices(seconds, names, ending=ending, progress=show))
        if other == "lsl":
            from study_app.evidence.outlets import compare_streams, localhost_only, measure_streams, streams_evidence

            localhost_only()
            lateness = measure_streams(seconds, ending=ending, progress=show)
            compared = compare_streams(min(seconds, _MAX_COMPARISON_S), ending=ending, progress=show)
            return streams_evidence(lateness, compared)
        from study_app.evidence.outlets import measure_triggers, triggers_evidence

        return triggers_evidence(measure_triggers(triggers or "", seconds, ending=ending, progress=show))

    if other == "delays":
        from study_app.app.delay_session import measure_delays
        from study_app.evidence.timing import delays_evidence

        with progress(partial(click.echo, err=True)) as show:
            result = delays_evidence(measure_delays(seconds, load, progress=show))
    else:
        windows = _windows_thread(load) if load != "none" or not other else None
        with _ending_by_signal() as (ending, _), progress(partial(click.echo, err=True)) as show:
            if other:
                result = under_load(load, windows, partial(measure_other, ending, show))
            else:
                from study_app.evidence.timing import measure_timing, timing_evidence

                timed = measure_timing(seconds, load, windows, spin_us=spin_us, ending=ending, progress=show)
                result = timing_evidence(timed)
    _present_evidence(result, to)


def _choose_display() -> None:
    """Use Qt's offscreen platform if there is no display."""
    if sys.platform == "linux" and not any(map(os.environ.get, ("QT_QPA_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY"))):
        os.environ["QT_QPA_PLATFORM"] = "offscreen"


def _windows_thread(load: LoadName) -> WindowsThread | None:
    """Return the GUI thread, or None if Qt cannot be loaded and the load does not need it."""
    try:
        from study_app.app.delay_session import WindowsThread
    except DisplayError:
        if load != "none":
            raise
        return None
    return WindowsThread(load)


@contextmanager
def _ending_by_signal() -> Iterator[tuple[threading.Event, list[int]]]:
    """Yield an event that Ctrl+C or a request to terminate sets, and the list of received signals."""
    ending = threading.Event()
    received: list[int] = []

    def end(number: int, _frame: FrameType | None) -> None:
        received.append(number)
        ending.set()

    previous_handlers = {number: signal.signal(number, end) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield ending, received
    finally:
        for number, handler in previous_handlers.items():
            signal.signal(number, handler)


@click.command()
@click.argument("protocol", metavar="[FILE]", default="rek2024")
@click.option("--hours", type=float, required=True, metavar="H", help="Duration in hours; 0.01 is 36 seconds.")
@click.option("--virtual", is_flag=True, help="Run in virtual time, in which a day takes minutes.")
@click.option("--seed", type=WholeNumber(0, 2**31 - 1), default=1, show_default=True, help="Seed for the faults.")
@click.option(
    "--load",
    type=_LOAD,
    default="none",
    help="gui: paint both windows of a session; gui+cpu: also keep all cores busy.",
)
@click.option("--to", type=Target(), metavar="DIR", help="Folder for the report.")
@click.pass_context
def soak(
    context: click.Context, hours: float, protocol: str, seed: int, load: LoadName, to: Path | None, *, virtual: bool
) -> None:
    """Run the servo for hours with a moving hand and every kind of fault, and report drift, leaks and failures.

    FILE defines the liquids; default: rek2024. Ctrl+C ends the command and prints the report so far.
    """
    from study_app.evidence.computer import under_load
    from study_app.evidence.soak import soak_servo
    from study_app.protocol.load import load_scenes

    scenes = load_scenes(protocol)
    make_output_folder(to)
    with _ending_by_signal() as (ending, received):
        result = under_load(
            load,
            _windows_thread(load) if load != "none" else None,
            lambda: soak_servo(scenes, hours, virtual=virtual, seed=seed, ending=ending, progress=click.echo),
        )
    if result.ticks > 0:
        click.echo()
    _present_evidence(result.evidence(), to)
    if received:
        context.exit(128 + received[0])


_SHOW_EVERY_S: Final = 20.0
"""Minimum time between lines of progress outside a terminal [s]."""


def _timed_lines() -> Callable[[str], None]:
    """Return a function that prints lines on standard error, with the time since this call."""
    started_s = time.perf_counter()
    return lambda text: click.echo(f"{time.perf_counter() - started_s:.0f} s: {text}", err=True)


def _at_intervals(show: Callable[[str], None]) -> Callable[[str], None]:
    """Return a function like ``show`` that ignores texts within `_SHOW_EVERY_S` of the last shown one."""
    shown_s = -math.inf

    def show_sometimes(text: str) -> None:
        nonlocal shown_s
        if time.perf_counter() - shown_s >= _SHOW_EVERY_S:
            shown_s = time.perf_counter()
            show(text)

    return show_sometimes


@click.command("validate-report")
@click.option(
    "--studies",
    type=WholeNumber(1, 1_000_000),
    default=1000,
    show_default=True,
    help="Initial number of studies per cell.",
)
@takes_workers
@click.option("--seed", type=WholeNumber(0, 2**31 - 1), default=1, show_default=True, help="Seed for the simulation.")
@click.option("--to", type=Target(), metavar="DIR", help="Folder for rates.md and rates.csv.")
def validate_report(studies: int, workers: Workers, seed: int, to: Path | None) -> None:
    """Measure how often the report's verdicts are wrong in simulated studies in which none, some or all effects exist.

    The report's own tests are applied to simulated rek2024 studies with 5, 12 and 24 participants. The answers come
    from the answer model used in rehearsals or from an ordinal probit model with random effects. The command prints
    each rate with its Wilson interval and says whether the rate meets its limit. A limit of 5 % is met if the interval
    ends below 7.5 %, and exceeded if an interval corrected for the number of rates lies above 5 %. For some tests,
    values are drawn directly from distributions: hypotheses, recognition, equivalence when a minority of participants
    respond differently, and trends with skewed answers. If a rate is still undecided, more studies are simulated for
    it, up to four times the initial number. Ctrl+C ends the command and prints the results so far. The exit code is 3
    if a rate exceeds its limit; otherwise it is 4 if there are too few studies to decide on every rate.
    """
    from study_app.analysis.planning.simulated_studies import plan
    from study_app.evidence.report_rates import Rate, measure_report_rates, report_rates_evidence
    from study_app.protocol.load import load
    from study_app.session.simulated.rehearsal import condition_features

    make_output_folder(to)
    rates: tuple[Rate, ...] = ()
    started_s, done = time.perf_counter(), 0
    print_line = _timed_lines()
    try:
        with progress(_at_intervals(print_line)) as show, executor_for(workers) as executor:
            show("rehearsing every condition")
            protocol = load("rek2024")
            studied = plan(protocol, condition_features(protocol, seed=seed))
            started_s = time.perf_counter()
            for done, new_rates in measure_report_rates(studied, studies, executor, seed=seed, progress=print_line):
                rates = new_rates
                show(f"{done} studies")
    except KeyboardInterrupt:
        click.echo("ended early", err=True)
    _present_evidence(report_rates_evidence(rates, f"{done} studies in {time.perf_counter() - started_s:.0f} s"), to)


@click.command()
@click.argument("files", metavar="[FILE]...", nargs=-1)
@click.option(
    "--studies",
    type=WholeNumber(10, 1_000_000),
    default=40,
    show_default=True,
    help="Number of studies with 20 participants for each protocol and seed.",
)
@click.option(
    "--seed",
    "seeds",
    type=WholeNumber(0, 2**31 - 1),
    multiple=True,
    default=(1,),
    show_default=True,
    help="Seed for the simulation. Repeat the option to use several seeds; all studies are evaluated together.",
)
@takes_workers
@click.option("--to", type=Target(), metavar="DIR", help="Folder for thresholds.md and thresholds.csv.")
def validate(files: tuple[str, ...], studies: int, seeds: tuple[int, ...], workers: Workers, to: Path | None) -> None:
    """Recover simulated observers' known thresholds, first with methods and analysis alone, then in complete sessions.

    For each protocol (default: viscosityjnd, delaydetect, delayjnd, thickness, forcedelay), the command simulates and
    analyses many studies with 20 observers whose thresholds differ by a factor of 1.2. For magnitude estimation, the
    exponent is known instead of a threshold. The command then runs complete sessions with two simulated
    participants, including the servo, files, unblinding and analysis. Every value is printed with its limit; the
    interval in brackets is corrected for the number of values. The exit code is 3 if an interval lies beyond its limit.
    """
    from study_app.evidence.thresholds import NAMES, known_value, known_values_evidence
    from study_app.evidence.thresholds import validate_known_values as validate_values
    from study_app.protocol.load import load, source_bytes

    try:
        chosen = [(source_bytes(name), known_value(Path(name).stem, load(name))) for name in files or NAMES]
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    make_output_folder(to)
    started_s, print_line = time.perf_counter(), _timed_lines()
    with progress(_at_intervals(print_line)) as show, executor_for(workers) as executor:
        verdicts = validate_values(chosen, studies, seeds, executor, show, print_line)
    used_s = sum(os.times()[:4])  # includes that of the workers, which have ended
    duration = f"{time.perf_counter() - started_s:.0f} s, {used_s:.0f} s of processor time"
    heading = f"{studies} studies for each protocol and seed ({', '.join(map(str, seeds))}), in {duration}"
    _present_evidence(known_values_evidence(verdicts, heading), to)


@click.command("delay-thresholds")
@click.option(
    "--people", type=WholeNumber(5, 1000), default=40, show_default=True, help="Number of simulated participants."
)
@click.option("--seed", type=WholeNumber(0, 2**31 - 1), default=1, show_default=True, help="Seed for the simulation.")
@click.option("--to", type=Target(), metavar="DIR", help="Folder for the table and the figure.")
def delay_thresholds(people: int, seed: int, to: Path | None) -> None:
    """Compare the delays that simulated participants rate as different (rek2024) and that they detect (delaydetect).

    The ratings depend on each participant's criterion; the forced choices do not.
    """
    from study_app.evidence.thresholds import compare_delays, noticed_delays_evidence

    with progress() as show:
        show("simulating participants")
        comparison = compare_delays(people, seed)
    _present_evidence(noticed_delays_evidence(comparison), to)
