"""The stability of hard cases: the sweep with the safety layer off and on, the other groups with it, as text and files.

What a case is made of is said in `stability_cases`, which cases there are in `case_groups`, when one counts as unstable
in `verdict`, what safety takes away where it is not needed in `fidelity`, the maximum stable damping in
`damping_limits`.
"""

import collections
import itertools
import math
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import astuple, dataclass, fields
from typing import Any, Final

from study_app.evidence.stability.case_groups import Group
from study_app.evidence.stability.damping_limits import DELAYS, PERIODS_S, measure_limits, measured_estimators
from study_app.evidence.stability.driver_loop import judge_driven
from study_app.evidence.stability.fidelity import LOOPS, Fidelity, by_liquid
from study_app.evidence.stability.stability_cases import FALCON, Case
from study_app.evidence.stability.stability_map import draw_map
from study_app.evidence.stability.verdict import REASONS, Verdict, judge
from study_app.evidence.table import Evidence, Table, plot_files, run
from study_app.haptics.model.layout import LIMITER_NAMES
from study_app.haptics.model.slope_limits import table
from study_app.store.tables.csv_files import csv_text_of

MEASURES: Final = ("balance_j", "permitted_j", "swing_mps", "fast_n", "played_n")


@dataclass(frozen=True, slots=True)
class Judged:
    """The verdicts on a group of cases, with safety on."""

    name: str
    verdicts: tuple[Verdict, ...]

    @property
    def unstable(self) -> tuple[Verdict, ...]:
        """Those that are unstable."""
        return tuple(verdict for verdict in self.verdicts if not verdict.stable)


@dataclass(frozen=True, slots=True)
class Swept:
    """The verdicts on the sweep with safety off and on, those on other groups, and how long they took."""

    off: tuple[Verdict, ...]
    on: tuple[Verdict, ...]
    took_s: float
    others: tuple[Judged, ...] = ()

    @property
    def unstable(self) -> tuple[Verdict, ...]:
        """Those that are unstable although safety is on."""
        return tuple(verdict for one in self.groups for verdict in one.unstable)

    @property
    def groups(self) -> tuple[Judged, ...]:
        """All groups, the sweep with safety on, if it was judged, before the others."""
        return (*([Judged("first plant", self.on)] if self.on else []), *self.others)


def run_sweep(
    cases: Sequence[Case],
    others: Sequence[Group],
    executor: Executor,
    progress: Callable[[int, int], object] = lambda _done, _of: None,
) -> Swept:
    """Judge the sweep's cases with safety off and on, and the other groups with it, by an executor.

    ``progress`` is called with the number of verdicts so far and the number of all.
    """
    began = time.perf_counter()
    planned = [(case, safe) for safe in (False, True) for case in cases]
    planned += [(case, True) for group in others for case in group.cases]
    verdicts = iter(run(_judge, planned, executor, lambda done: progress(done, len(planned))))
    off, on = [tuple(itertools.islice(verdicts, len(cases))) for _ in range(2)]
    judged = [Judged(group.name, tuple(itertools.islice(verdicts, len(group.cases)))) for group in others]
    return Swept(off, on, time.perf_counter() - began, tuple(judged))


def verdicts_on(case: Case) -> tuple[Verdict, ...]:
    """Judge a case with safety off and on; through the Falcon's driver, which knows no other loop, with it alone."""
    return tuple(_judge(case, safe) for safe in ((True,) if case.plant == FALCON else (False, True)))


def _judge(case: Case, safe: bool) -> Verdict:
    return judge_driven(case) if case.plant == FALCON else judge(case, safe=safe)


def in_words(verdict: Verdict) -> str:
    """Return a verdict as a sentence."""
    said = f"safety {'on' if verdict.safe else 'off'}: "
    said += "stable" if verdict.stable else f"unstable ({', '.join(verdict.reasons)})"
    if verdict.reasons == ("not finite",):
        return said
    reference = "with the scripted device" if verdict.case.plant == FALCON else "without feedback"
    said += (
        f"; the balance of hand and liquid falls to {1e3 * verdict.balance_j:.2f} mJ "
        f"({1e3 * verdict.permitted_j:.2f} mJ permitted), the handle swings at {1e3 * verdict.swing_mps:.0f} mm/s, "
        f"the force above 40 Hz is {verdict.fast_n:.2f} N ({verdict.played_n:.2f} N {reference})"
    )
    acted = [f"{name} {share:.1%}" for name, share in zip(LIMITER_NAMES, verdict.acted, strict=True) if share]
    return f"{said}; limiters, in ticks: {', '.join(acted)}" if acted else said


def summary(swept: Swept, fidelities: Sequence[Fidelity]) -> str:
    """Return what came out, as text: how many are unstable and why, which limiters acted, what they take away."""
    return "\n".join((*_counts(swept), "", group_table(swept), "", *_limiters(swept), "", *_fidelity(fidelities)))


def _counts(swept: Swept) -> Iterator[str]:
    cases, others = len(swept.on), sum(len(one.verdicts) for one in swept.others)
    yield f"{cases} cases with safety off and on, {others} others with it, {swept.took_s:.0f} s"
    yield f"{'':24} safety off   safety on"
    reasons = [collections.Counter(r for v in verdicts for r in v.reasons) for verdicts in (swept.off, swept.on)]
    unstable = [sum(not verdict.stable for verdict in verdicts) for verdicts in (swept.off, swept.on)]
    yield f"{'unstable':24} {unstable[0]:10d}  {unstable[1]:10d}"
    for reason in REASONS:
        yield f"  {reason:22} {reasons[0][reason]:10d}  {reasons[1][reason]:10d}"


def group_table(swept: Swept) -> str:
    """Return, for each group, the unstable cases and the most energy that the handle got from a liquid."""
    return "\n".join(_group_lines(swept))


def _group_lines(swept: Swept) -> Iterator[str]:
    width = max(len(one.name) for one in swept.groups)
    yield f"{'with safety on':{width + 2}}   cases  unstable   given out   beyond the bound, at most [mJ]"
    for one in swept.groups:
        finite = [verdict for verdict in one.verdicts if math.isfinite(verdict.balance_j)]
        given_j = max((-verdict.balance_j for verdict in finite), default=math.nan)
        beyond_j = max((max(verdict.permitted_j - verdict.balance_j, 0.0) for verdict in finite), default=math.nan)
        counts = f"{len(one.verdicts):7} {len(one.unstable):9} {1e3 * given_j:11.2f} {1e3 * beyond_j:11.2f}"
        reasons = collections.Counter(reason for verdict in one.unstable for reason in verdict.reasons)
        why = ", ".join(f"{reason} {count}" for reason, count in reasons.items())
        yield f"  {one.name:{width}} {counts}   {why}".rstrip()


def _limiters(swept: Swept) -> Iterator[str]:
    """Yield how often each limiter acted."""
    cases = len(swept.on)
    yield f"{'with safety on':24}   in cases    in ticks"
    for k, name in enumerate(LIMITER_NAMES):
        shares = [verdict.acted[k] for verdict in swept.on]
        if any(shares):
            yield f"  {name:22} {sum(share > 0 for share in shares) / cases:10.1%}  {sum(shares) / cases:10.2%}"


def _fidelity(fidelities: Sequence[Fidelity]) -> Iterator[str]:
    yield "force sent against the model clamped to 8 N, hand attached: rms difference in % of the rms force, the worst"
    yield "of twelve motions; * more than 5 % and 0.05 N. The second number: the most ticks with such a difference."
    yield f"{'rate, ticks of delay':22}" + "".join(f"{f'{rate_hz:g} Hz, {delay}':>16}" for rate_hz, delay in LOOPS)
    for liquid, row in by_liquid(fidelities).items():
        cells = (f"{f'{one.share:.1%}' + ' *'[not one.within]} {one.beyond:6.1%}" for one in row)
        yield f"  {liquid:20}" + "".join(f"{cell:>16}" for cell in cells)


def evidence(swept: Swept, fidelities: Sequence[Fidelity]) -> Evidence:
    """Return the summary, or of groups alone their table; the cases as CSV, the unstable ones as text, and the map."""
    text = summary(swept, fidelities) if swept.on else group_table(swept)
    lines = ("# When the simulation is stable", "", "```", text, "```", "", "![Map](map.png)", "")
    unstable = (*(f"- unstable with safety on: `{verdict.case}`" for verdict in swept.unstable), "")
    files = {"cases.csv": _cases_csv(swept), "stability.md": "\n".join((*lines, *unstable))}
    for safety, verdicts in (("off", swept.off), ("on", swept.unstable)):
        lines_of_cases = (f"{verdict.case}\n" for verdict in verdicts if not verdict.stable)
        files[f"unstable-safety-{safety}.txt"] = "".join(lines_of_cases)
    figures = plot_files("map", "Where a liquid stays stable", draw_map, swept.off)
    return Evidence(f"{text}\n", files, figures, missed=bool(swept.unstable))


def limits(executor: Executor, progress: Callable[[int, int], object], file: str) -> Evidence:
    """Measure the table of limits that `haptics.model.slope_limits` reads, by an executor.

    The rows of "line", which are for velocities that a device measures, are those of the shipped table.
    """
    lines = len(measured_estimators()) * len(PERIODS_S) * len(DELAYS[1:])
    rows = []
    shipped = (entry for entry in table() if entry.estimator == "line")
    for name, value, period_s, delay, (drag, inertia) in itertools.chain(measure_limits(executor=executor), shipped):
        parameter = "" if value is None else f"{value:g}"
        rows.append((name, parameter, f"{period_s * 1e3:g}", delay, f"{drag:g}", f"{inertia:g}"))
        progress(min(len(rows), lines), lines)
    names = ("estimator", "parameter", "period_ms", "delay_ticks", "drag_nspm", "inertia_nspm")
    return Evidence("", {file: Table(names, rows).csv()})


def _cases_csv(swept: Swept) -> str:
    names = [f"{name}_{safety}" for safety in ("off", "on") for name in ("unstable", *MEASURES)]
    rows: list[Sequence[Any]] = [(*(field.name for field in fields(Case)), *names, *(f"{n}_on" for n in LIMITER_NAMES))]
    for off, on in zip(swept.off, swept.on, strict=True):
        row = list(astuple(off.case))
        for verdict in (off, on):
            row += ["; ".join(verdict.reasons), *(f"{getattr(verdict, name):.4g}" for name in MEASURES)]
        rows.append((*row, *(f"{share:.4g}" for share in on.acted)))
    return csv_text_of(rows)
