"""The stability of hard cases: the sweep with the safety layer off and on, the other groups with it on.

`stability_cases` defines a case, `case_groups` lists the cases, `verdict` defines when one is unstable or noisy, and
`damping_limits` measures the maximum stable damping. The map shows the boundary of a free handle, the passive limit
that follows from its friction, the limits in use, and the results of a sweep.
"""

import collections
import itertools
import math
import textwrap
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import astuple, dataclass, fields
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator, StrMethodFormatter

from study_app import figure_style as style
from study_app.evidence.stability.bench import FORCE_LIMIT_N, Bench, lasts_s, new_trace
from study_app.evidence.stability.case_groups import Group
from study_app.evidence.stability.damping_limits import (
    DELAYS,
    FREE_HANDLE_KG,
    NOMINAL_S,
    PERIODS_S,
    boundary_nspm,
    measure_limits,
    measured_estimators,
    passive_nspm,
)
from study_app.evidence.stability.driver_loop import judge_driven
from study_app.evidence.stability.stability_cases import CIRCLES, FALCON, REACHES, STROKE, Case, liquids
from study_app.evidence.stability.verdict import NOISY, REASONS, UNSTABLE, Verdict, judge
from study_app.evidence.table import Evidence, Table, plot_files, run
from study_app.haptics.model.layout import LIMITER_NAMES
from study_app.haptics.model.scene import Ewma
from study_app.haptics.model.slope_limits import slope_limit, slope_limit_table
from study_app.number_text import counted
from study_app.store.files import csv_text_of

_HEIGHT_PT: Final = 256.0
_PLOT_PT: Final = 146.0
_FOOT_PT: Final = 62.0
_FRICTIONS_NSPM: Final = (0.1, 0.3, 1.0, 3.0, 10.0)
_MAP_DELAYS: Final = (0, 1, 2, 4)
_LIMIT_DELAYS: Final = (1, 2, 4)
_COLOURS: Final = dict(zip(_MAP_DELAYS, (style.STEPS[0], style.STEPS[1], style.STEPS[3], style.STEPS[4]), strict=True))
_CAPTION: Final = (
    "Lines show the boundary measured with the servo's own tick, an exact encoder and safety off. The dashed "
    "line is b = B·α/(2 − α), extended to include the delay; below it the loop is stable for any hand. Bars show the "
    "limits in use; they exceed half the boundary only at 1 kHz with up to one tick of delay."
)
_CAPTION_LETTERS: Final = 112
_MARKS: Final = dict(zip(_MAP_DELAYS, "osD^", strict=True))


@style.own_settings(style.PLOT_SETTINGS)
def draw_map(off: Sequence[Verdict]) -> Figure:
    """Draw the stability map; ``off`` are the verdicts of a sweep without safety."""
    figure = Figure(figsize=(style.PAGE_WIDTH_PT / 72, _HEIGHT_PT / 72), facecolor="white")
    width_pt = style.PAGE_WIDTH_PT
    axes = [
        figure.add_axes((left_pt / width_pt, _FOOT_PT / _HEIGHT_PT, wide_pt / width_pt, _PLOT_PT / _HEIGHT_PT))
        for left_pt, wide_pt in ((34, 150), (232, 118), (400, 105))
    ]
    _draw_boundary(axes[0])
    _draw_limits(axes[1])
    _draw_unstable_shares(axes[2], off)
    caption = textwrap.fill(_CAPTION, _CAPTION_LETTERS)
    figure.text(34 / width_pt, 6 / _HEIGHT_PT, caption, color=style.TEXT_SOFT, linespacing=1.25)
    return figure


def _draw_boundary(axes: Axes) -> None:
    """Draw the maximum stable damping of a handle with some friction, and the passive limit given by friction alone."""
    for delay in _MAP_DELAYS:
        measured = [boundary_nspm(Ewma(), NOMINAL_S, delay, friction_nspm=b) for b in _FRICTIONS_NSPM]
        proved = [passive_nspm(b, NOMINAL_S, delay) for b in _FRICTIONS_NSPM]
        line_style: dict[str, Any] = {"color": _COLOURS[delay]}
        axes.plot(_FRICTIONS_NSPM, measured, marker=_MARKS[delay], markersize=3, label=str(delay), **line_style)
        axes.plot(_FRICTIONS_NSPM, proved, linestyle=(0, (3, 2)), linewidth=0.9, **line_style)
    _set_log_axes(axes, _FRICTIONS_NSPM, (1, 10, 100))
    axes.set_title(f"Maximum stable damping B [N·s/m]\nwith a {FREE_HANDLE_KG:g} kg handle at 1 kHz", pad=26)
    axes.set_xlabel("Friction b of the handle [N·s/m]", loc="right", labelpad=1)
    _name_curves(axes, 4)


def _draw_limits(axes: Axes) -> None:
    periods_ms = [period_s * 1e3 for period_s in PERIODS_S]
    for delay in _LIMIT_DELAYS:
        measured = [boundary_nspm(Ewma(), period_s, delay) for period_s in PERIODS_S]
        allowed = [slope_limit(period_s, delay) for period_s in PERIODS_S]
        line_style: dict[str, Any] = {"color": _COLOURS[delay]}
        axes.plot(periods_ms, measured, marker=_MARKS[delay], markersize=3, label=str(delay), **line_style)
        for period_ms, limit in zip(periods_ms, allowed, strict=True):
            axes.plot((period_ms / 1.18, period_ms * 1.18), (limit, limit), linewidth=2.2, **line_style)
    _set_log_axes(axes, periods_ms, (3, 10, 30, 100))
    axes.set_title("Boundary and limit (bars)\nof B [N·s/m]", pad=26)
    axes.set_xlabel("Time between ticks [ms]", loc="right", labelpad=1)
    _name_curves(axes, 3)


def _draw_unstable_shares(axes: Axes, off: Sequence[Verdict]) -> None:
    """Draw the percentage of sweep cases that are unstable without safety, against rate and delay."""
    totals: collections.Counter[tuple[float, int]] = collections.Counter()
    unstable: collections.Counter[tuple[float, int]] = collections.Counter()
    for verdict in off:
        totals[verdict.case.rate_hz, verdict.case.delay] += 1
        unstable[verdict.case.rate_hz, verdict.case.delay] += verdict.grade == UNSTABLE
    rates_hz = sorted({rate_hz for rate_hz, _ in totals}, reverse=True)
    proportions = np.array([[unstable[r, d] / max(totals[r, d], 1) for r in rates_hz] for d in DELAYS])
    axes.grid(visible=False)
    axes.imshow(proportions, cmap="Blues", vmin=0, vmax=1, aspect="auto", origin="lower")
    for (row, column), proportion in np.ndenumerate(proportions):
        colour = "white" if proportion > 0.55 else style.TEXT
        axes.text(column, row, f"{proportion:.0%}", ha="center", va="center", color=colour)
    axes.set_xticks(range(len(rates_hz)), [f"{1e3 / rate_hz:g}" for rate_hz in rates_hz])
    axes.set_yticks(range(len(DELAYS)), [str(delay) for delay in DELAYS])
    axes.set_title("Unstable cases, safety off,\nby ticks of delay", pad=5)
    axes.set_xlabel("Time between ticks [ms]", loc="right", labelpad=1)


def _set_log_axes(axes: Axes, x: Sequence[float], y: Sequence[float]) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis, places in ((axes.xaxis, x), (axes.yaxis, y)):
        axis.set_major_locator(FixedLocator(list(places)))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))


def _name_curves(axes: Axes, columns: int) -> None:
    axes.legend(
        title="ticks of delay",
        title_fontsize=7.5,
        alignment="left",
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=columns,
        frameon=False,
        handlelength=1.2,
        handletextpad=0.4,
        columnspacing=0.9,
        borderpad=0,
        borderaxespad=0.2,
    )


LOOPS: Final = ((1000.0, 0), (1000.0, 1), (1000.0, 2), (1000.0, 4), (2000.0, 1), (500.0, 1), (250.0, 1))
"""Ticks per second and ticks of delay; the first two loops are those of a study."""
_MOTIONS: Final = (REACHES, CIRCLES, STROKE)
_SPEEDS_MPS: Final = (0.1, 0.3, 0.6, 1.0)
_RELATIVE: Final = 0.05
_ABSOLUTE_N: Final = 0.05
_SETTLED_S: Final = 0.2
_MOVING_S: Final = 1.2


class Fidelity(NamedTuple):
    """One liquid in one loop, in the worst of its motions.

    ``difference_n`` and ``force_n`` are RMS values [N] over a motion; ``beyond`` is the greatest proportion of ticks
    whose force differs by more than the target.
    """

    liquid: str
    rate_hz: float
    delay: int
    difference_n: float
    force_n: float
    beyond: float

    @property
    def share(self) -> float:
        return self.difference_n / self.force_n if self.force_n > 0 else 0.0

    @property
    def target_n(self) -> float:
        """The greatest permitted difference [N]."""
        return max(_RELATIVE * self.force_n, _ABSOLUTE_N)

    @property
    def within(self) -> bool:
        return self.difference_n <= self.target_n


def fidelities(
    names: Sequence[str] | None = None, loops: Sequence[tuple[float, int]] = LOOPS, *, executor: Executor | None = None
) -> tuple[Fidelity, ...]:
    """Measure how much the safety layer changes the force of liquids (by default all) in each loop.

    Each liquid has its own scale and estimator, and is moved by a medium hand (0.55 kg, 135 N/m, 6.5 N·s/m) along
    reaches, circles and strokes of 0.1 to 1 m/s. The force sent is compared with the model's, clamped to 8 N. The
    target is that for the selection of effects: an RMS of 5 % or 0.05 N, whichever is greater, over a motion. Single
    ticks may differ by more, for example when a wake breaks or the hand reverses.
    """
    return run(_worst_fidelity, itertools.product(names or liquids(), loops), executor)


def _worst_fidelity(liquid: str, loop: tuple[float, int]) -> Fidelity:
    """Return the fidelity of the motion that exceeds its target most."""
    measured = list(_measure_motions(liquid, *loop))
    beyond = max(fidelity.beyond for fidelity in measured)
    return max(measured, key=lambda fidelity: fidelity.difference_n / fidelity.target_n)._replace(beyond=beyond)


def _measure_motions(liquid: str, rate_hz: float, delay: int) -> Iterator[Fidelity]:
    scene = liquids()[liquid]
    for motion, speed_mps in itertools.product(_MOTIONS, _SPEEDS_MPS):
        case = Case(
            liquid=liquid,
            scale=scene.scale,
            rate_hz=rate_hz,
            delay=delay,
            estimator=scene.velocity.kind,
            motion=motion,
            speed_mps=speed_mps,
        )
        bench, trace = Bench(case), new_trace(case)
        bench.begin()
        trace = trace[: bench.run(trace, 0, lasts_s(case))]
        trace = trace[(trace.t_s > _SETTLED_S) & (trace.t_s < _MOVING_S)]
        yield _compare_forces(case, trace)


def _compare_forces(case: Case, trace: Any) -> Fidelity:
    """Compare the force sent with the model's force, clamped in the same direction."""
    model_n = np.linalg.norm(trace.asked_n, axis=1)
    clamped_n = trace.asked_n * np.minimum(1.0, FORCE_LIMIT_N / np.maximum(model_n, 1e-12))[:, None]
    force_n = np.linalg.norm(clamped_n, axis=1)
    error_n = np.linalg.norm(trace.sent_n - clamped_n, axis=1)
    return Fidelity(
        liquid=case.liquid,
        rate_hz=case.rate_hz,
        delay=case.delay,
        difference_n=float(np.sqrt(np.mean(error_n**2))),
        force_n=float(np.sqrt(np.mean(force_n**2))),
        beyond=float(np.mean(error_n > np.maximum(_RELATIVE * force_n, _ABSOLUTE_N))),
    )


_NOISY_SHARE: Final = 1e-4
_MEASURES: Final = ("balance_j", "permitted_j", "swing_mps", "fast_n", "played_n")


@dataclass(frozen=True, slots=True)
class _JudgedGroup:
    """The verdicts on a group of cases with safety on."""

    name: str
    verdicts: tuple[Verdict, ...]

    def of_grade(self, grade: str) -> tuple[Verdict, ...]:
        return tuple(verdict for verdict in self.verdicts if verdict.grade == grade)


@dataclass(frozen=True, slots=True)
class Swept:
    """The verdicts on the sweep with safety off and on, those on other groups, and the computation time."""

    off: tuple[Verdict, ...]
    on: tuple[Verdict, ...]
    took_s: float
    others: tuple[_JudgedGroup, ...] = ()

    def of_grade(self, grade: str) -> tuple[Verdict, ...]:
        """Return the verdicts of a grade among those with safety on."""
        return tuple(verdict for group in self.groups for verdict in group.of_grade(grade))

    @property
    def missed(self) -> bool:
        """Whether a case with safety on is unstable, or more than one in 10,000 are noisy."""
        judged = sum(len(group.verdicts) for group in self.groups)
        return bool(self.of_grade(UNSTABLE)) or len(self.of_grade(NOISY)) > _NOISY_SHARE * judged

    @property
    def groups(self) -> tuple[_JudgedGroup, ...]:
        """All groups; the sweep with safety on, if it was judged, comes first."""
        return (*([_JudgedGroup("first plant", self.on)] if self.on else []), *self.others)


def run_sweep(
    cases: Sequence[Case],
    others: Sequence[Group],
    executor: Executor,
    progress: Callable[[int, int], object] = lambda _done, _of: None,
) -> Swept:
    """Judge the sweep's cases with safety off and on, and the other groups with safety on, by an executor.

    ``progress`` is called with the number of verdicts so far and the total number.
    """
    began = time.perf_counter()
    planned = [(case, safe) for safe in (False, True) for case in cases]
    planned += [(case, True) for group in others for case in group.cases]
    verdicts = iter(run(_judge_case, planned, executor, lambda done: progress(done, len(planned))))
    off, on = [tuple(itertools.islice(verdicts, len(cases))) for _ in range(2)]
    judged = [_JudgedGroup(group.name, tuple(itertools.islice(verdicts, len(group.cases)))) for group in others]
    return Swept(off, on, time.perf_counter() - began, tuple(judged))


def verdicts_on(case: Case) -> tuple[Verdict, ...]:
    """Judge a case with safety off and on; only with safety on if it uses the Falcon driver."""
    return tuple(_judge_case(case, safe) for safe in ((True,) if case.plant == FALCON else (False, True)))


def _judge_case(case: Case, safe: bool) -> Verdict:
    return judge_driven(case) if case.plant == FALCON else judge(case, safe=safe)


def verdict_text(verdict: Verdict) -> str:
    """Return a verdict as a sentence."""
    text = f"safety {'on' if verdict.safe else 'off'}: "
    text += f"{verdict.grade} ({', '.join(verdict.reasons)})" if verdict.reasons else verdict.grade
    if verdict.reasons == ("not finite",):
        return text
    reference = "with the scripted device" if verdict.case.plant == FALCON else "without feedback"
    text += (
        f"; the energy balance of hand and liquid falls to {1e3 * verdict.balance_j:.2f} mJ "
        f"({1e3 * verdict.permitted_j:.2f} mJ permitted), the handle oscillates at {1e3 * verdict.swing_mps:.0f} mm/s, "
        f"the force above 40 Hz is {verdict.fast_n:.2f} N ({verdict.played_n:.2f} N {reference})"
    )
    limiter_shares = [
        f"{name} {proportion:.1%}" for name, proportion in zip(LIMITER_NAMES, verdict.acted, strict=True) if proportion
    ]
    return (
        f"{text}; proportion of ticks on which each limiter was active: {', '.join(limiter_shares)}"
        if limiter_shares
        else text
    )


def summary(swept: Swept, fidelities: Sequence[Fidelity]) -> str:
    """Return a summary as text: the number of unstable cases and why, the active limiters, and the force withheld."""
    return "\n".join(
        (*_count_lines(swept), "", group_table(swept), "", *_limiter_lines(swept), "", *_fidelity_lines(fidelities))
    )


def _count_lines(swept: Swept) -> Iterator[str]:
    cases, others = len(swept.on), sum(len(other.verdicts) for other in swept.others)
    yield f"{cases} cases with safety off and on, {others} other cases with safety on, {swept.took_s:.0f} s"
    yield f"{'':24} safety off   safety on"
    reasons = [collections.Counter(r for v in verdicts for r in v.reasons) for verdicts in (swept.off, swept.on)]
    grades = [collections.Counter(verdict.grade for verdict in verdicts) for verdicts in (swept.off, swept.on)]
    yield f"{UNSTABLE:24} {grades[0][UNSTABLE]:10d}  {grades[1][UNSTABLE]:10d}"
    for reason in REASONS[:-1]:
        yield f"  {reason:22} {reasons[0][reason]:10d}  {reasons[1][reason]:10d}"
    yield f"{NOISY:24} {grades[0][NOISY]:10d}  {grades[1][NOISY]:10d}"


def group_table(swept: Swept) -> str:
    """Return, for each group, the unstable and noisy cases and the most energy that the handle gained from a liquid."""
    return "\n".join((*_group_lines(swept), "", _grade_line(swept)))


def _grade_line(swept: Swept) -> str:
    """Return the numbers of unstable and noisy cases with safety on, and the greatest force of the noisy ones."""
    unstable, noisy = swept.of_grade(UNSTABLE), swept.of_grade(NOISY)
    judged = sum(len(group.verdicts) for group in swept.groups)
    line = f"{counted(judged, 'case')} with safety on: {len(unstable)} unstable, {len(noisy)} noisy"
    if not noisy:
        return line
    force_n = max(verdict.fast_n for verdict in noisy)
    excess_n = max(verdict.fast_n - verdict.played_n for verdict in noisy)
    return f"{line} (force above 40 Hz: at most {force_n:.2f} N, and at most {excess_n:.2f} N more than the control)"


def _group_lines(swept: Swept) -> Iterator[str]:
    width = max(len(group.name) for group in swept.groups)
    yield f"{'with safety on':{width + 2}}   cases  unstable   noisy    supplied   above bound (maximum energy [mJ])"
    for group in swept.groups:
        finite = [verdict for verdict in group.verdicts if math.isfinite(verdict.balance_j)]
        given_j = max((-verdict.balance_j for verdict in finite), default=math.nan)
        beyond_j = max((max(verdict.permitted_j - verdict.balance_j, 0.0) for verdict in finite), default=math.nan)
        unstable, noisy = [len(group.of_grade(grade)) for grade in (UNSTABLE, NOISY)]
        counts = f"{len(group.verdicts):7} {unstable:9} {noisy:7} {1e3 * given_j:11.2f} {1e3 * beyond_j:11.2f}"
        reasons = collections.Counter(reason for verdict in group.verdicts for reason in verdict.reasons)
        reasons_text = ", ".join(f"{reason} {count}" for reason, count in reasons.items())
        yield f"  {group.name:{width}} {counts}   {reasons_text}".rstrip()


def _limiter_lines(swept: Swept) -> Iterator[str]:
    cases = len(swept.on)
    yield f"{'with safety on':24}   in cases    in ticks"
    for k, name in enumerate(LIMITER_NAMES):
        proportions = [verdict.acted[k] for verdict in swept.on]
        if any(proportions):
            acting = sum(proportion > 0 for proportion in proportions) / cases
            yield f"  {name:22} {acting:10.1%}  {sum(proportions) / cases:10.2%}"


def _fidelity_lines(fidelities: Sequence[Fidelity]) -> Iterator[str]:
    yield "RMS difference between the sent force and the model force clamped to 8 N, with the hand attached (worst of"
    yield "twelve motions), as a percentage of the RMS force; * marks more than 5 % and 0.05 N. The second number is"
    yield "the largest proportion of ticks with such a difference."
    yield f"{'rate, ticks of delay':22}" + "".join(f"{f'{rate_hz:g} Hz, {delay}':>16}" for rate_hz, delay in LOOPS)
    for liquid, row in itertools.groupby(fidelities, key=lambda fidelity: fidelity.liquid):
        cells = (f"{f'{fidelity.share:.1%}' + ' *'[not fidelity.within]} {fidelity.beyond:6.1%}" for fidelity in row)
        yield f"  {liquid:20}" + "".join(f"{cell:>16}" for cell in cells)


def stability_evidence(swept: Swept, fidelities: Sequence[Fidelity], seed: str) -> Evidence:
    """Return a summary (or a table of groups), the cases as CSV, the unstable ones as text, and the map."""
    text = f"seed {seed}\n\n{summary(swept, fidelities) if swept.on else group_table(swept)}"
    lines = ("# When the simulation is stable", "", "```", text, "```", "", "![Map](map.png)", "")
    on = {grade: swept.of_grade(grade) for grade in (UNSTABLE, NOISY)}
    flagged = (f"- {grade} with safety on: `{verdict.case}`" for grade in on for verdict in on[grade])
    files = {"cases.csv": _cases_csv(swept), "stability.md": "\n".join((*lines, *flagged, ""))}
    off = [verdict for verdict in swept.off if verdict.grade == UNSTABLE]
    for name, verdicts in (("unstable-safety-off", off), *((f"{grade}-safety-on", on[grade]) for grade in on)):
        files[f"{name}.txt"] = "".join(f"{verdict.case}\n" for verdict in verdicts)
    figures = plot_files("map", "Where a liquid can be rendered stably", draw_map, swept.off)
    return Evidence(f"{text}\n", files, figures, missed=swept.missed)


def slope_limits_evidence(executor: Executor, progress: Callable[[int, int], object], file: str) -> Evidence:
    """Measure the table of limits that `haptics.model.slope_limits` reads, by an executor.

    The rows of "line", for velocities that a device measures, are copied from the shipped table.
    """
    lines = len(measured_estimators()) * len(PERIODS_S) * len(DELAYS[1:])
    rows = []
    shipped = (entry for entry in slope_limit_table() if entry.estimator == "line")
    for name, value, period_s, delay, (drag, inertia) in itertools.chain(measure_limits(executor=executor), shipped):
        parameter = "" if value is None else f"{value:g}"
        rows.append((name, parameter, f"{period_s * 1e3:g}", delay, f"{drag:g}", f"{inertia:g}"))
        progress(min(len(rows), lines), lines)
    names = ("estimator", "parameter", "period_ms", "delay_ticks", "drag_nspm", "inertia_nspm")
    return Evidence("", {file: Table(names, rows).csv()})


def _cases_csv(swept: Swept) -> str:
    names = [f"{name}_{safety}" for safety in ("off", "on") for name in ("grade", "reasons", *_MEASURES)]
    rows: list[Sequence[Any]] = [(*(field.name for field in fields(Case)), *names, *(f"{n}_on" for n in LIMITER_NAMES))]
    for off, on in zip(swept.off, swept.on, strict=True):
        row = list(astuple(off.case))
        for verdict in (off, on):
            row += [verdict.grade, "; ".join(verdict.reasons), *(f"{getattr(verdict, name):.4g}" for name in _MEASURES)]
        rows.append((*row, *(f"{proportion:.4g}" for proportion in on.acted)))
    return csv_text_of(rows)
