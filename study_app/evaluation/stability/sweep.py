"""The stability of hard cases: the whole sweep, each case with the safety layer off and on, told as text and files.

What a case is made of is said in `cases`, when it counts as unstable in `verdict`, what safety
takes away where it is not needed in `fidelity`, how much damping a loop bears in `boundary`.
"""

from __future__ import annotations

import collections
import csv
import io
import os
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Any, Final

from study_app.evaluation.output import make_folder
from study_app.evaluation.stability.boundary import measure_limits
from study_app.evaluation.stability.cases import Case
from study_app.evaluation.stability.fidelity import LOOPS, Fidelity, by_liquid
from study_app.evaluation.stability.map import draw_map
from study_app.evaluation.stability.verdict import REASONS, Verdict, judge
from study_app.haptics.layout import LIMITER_NAMES
from study_app.store.atomic import write_file

Tell = Callable[[int, int], None]

MEASURES: Final = ("balance_j", "permitted_j", "swing_mps", "fast_n", "played_n")


@dataclass(frozen=True, slots=True)
class Swept:
    """The verdicts on the same cases with safety off and on, and how long they took."""

    off: tuple[Verdict, ...]
    on: tuple[Verdict, ...]
    took_s: float

    @property
    def unstable(self) -> tuple[Verdict, ...]:
        """Those that are unstable although safety is on."""
        return tuple(verdict for verdict in self.on if not verdict.stable)


def run_sweep(cases: Sequence[Case], tell: Tell | None = None) -> Swept:
    """Judge every case with safety off and on, on all processors; ``tell`` hears how many of how many are done."""
    began = time.perf_counter()
    pairs = []
    with ThreadPoolExecutor(os.cpu_count() or 1) as threads:
        for pair in threads.map(_both, cases):
            pairs.append(pair)
            if tell is not None:
                tell(len(pairs), len(cases))
    off, on = zip(*pairs, strict=True)
    return Swept(off, on, time.perf_counter() - began)


def _both(case: Case) -> tuple[Verdict, Verdict]:
    return judge(case, safe=False), judge(case, safe=True)


def in_words(verdict: Verdict) -> str:
    """Return a verdict as a sentence."""
    said = f"safety {'on' if verdict.safe else 'off'}: "
    said += "stable" if verdict.stable else f"unstable ({', '.join(verdict.reasons)})"
    if verdict.reasons == ("not finite",):
        return said
    said += (
        f"; the balance of hand and liquid falls to {1e3 * verdict.balance_j:.2f} mJ "
        f"({1e3 * verdict.permitted_j:.2f} mJ permitted), the handle swings at {1e3 * verdict.swing_mps:.0f} mm/s, "
        f"the force above 40 Hz is {verdict.fast_n:.2f} N ({verdict.played_n:.2f} N without feedback)"
    )
    acted = [f"{name} {share:.1%}" for name, share in zip(LIMITER_NAMES, verdict.acted, strict=True) if share]
    return f"{said}; limiters, in turns: {', '.join(acted)}" if acted else said


def summary(swept: Swept, fidelities: Sequence[Fidelity]) -> str:
    """Return what came out, as text: how many are unstable and why, which limiters acted, what they take away."""
    return "\n".join((*_counts(swept), "", *_limiters(swept), "", *_fidelity(fidelities)))


def _counts(swept: Swept) -> Iterator[str]:
    cases = len(swept.on)
    yield f"{cases} cases, {swept.took_s:.0f} s"
    yield f"{'':24} safety off   safety on"
    reasons = [collections.Counter(r for v in verdicts for r in v.reasons) for verdicts in (swept.off, swept.on)]
    unstable = [sum(not verdict.stable for verdict in verdicts) for verdicts in (swept.off, swept.on)]
    yield f"{'unstable':24} {unstable[0]:10d}  {unstable[1]:10d}"
    for reason in REASONS:
        yield f"  {reason:22} {reasons[0][reason]:10d}  {reasons[1][reason]:10d}"


def _limiters(swept: Swept) -> Iterator[str]:
    """Yield how often each limiter acted."""
    cases = len(swept.on)
    yield f"{'with safety on':24}   in cases    in turns"
    for k, name in enumerate(LIMITER_NAMES):
        shares = [verdict.acted[k] for verdict in swept.on]
        if any(shares):
            yield f"  {name:22} {sum(share > 0 for share in shares) / cases:10.1%}  {sum(shares) / cases:10.2%}"


def _fidelity(fidelities: Sequence[Fidelity]) -> Iterator[str]:
    yield "force sent against the model clamped to 8 N, hand attached: rms difference in % of the rms force, the worst"
    yield "of twelve motions; * more than 5 % and 0.05 N. Beside it the most turns in which a force is as far off."
    yield f"{'rate, ticks of delay':22}" + "".join(f"{f'{rate_hz:g} Hz, {delay}':>16}" for rate_hz, delay in LOOPS)
    for liquid, row in by_liquid(fidelities).items():
        cells = (f"{f'{one.share:.1%}' + ' *'[not one.within]} {one.beyond:6.1%}" for one in row)
        yield f"  {liquid:20}" + "".join(f"{cell:>16}" for cell in cells)


def write(to: Path, swept: Swept, fidelities: Sequence[Fidelity]) -> tuple[Path, ...]:
    """Write table, failing cases, map and summary into the folder ``to``; return the files.

    Raises
    ------
    StoreError
        The folder or a file cannot be written.
    """
    make_folder(to)
    files = {"cases.csv": _cases_csv(swept).encode(), "stability.md": _markdown(swept, fidelities).encode()}
    for name, verdicts in (("unstable-safety-off.txt", swept.off), ("unstable-safety-on.txt", swept.on)):
        files[name] = "".join(f"{verdict.case}\n" for verdict in verdicts if not verdict.stable).encode()
    files |= {f"map.{kind}": content for kind, content in draw_map(swept.off).items()}
    for name, content in files.items():
        write_file(to / name, content)
    return tuple(to / name for name in files)


def write_limits(file: Path, tell: Tell | None = None) -> None:
    """Measure the table of limits that `haptics.limits` reads, and write it.

    Raises
    ------
    StoreError
        The file cannot be written.
    """
    rows: list[Sequence[Any]] = [("estimator", "period_ms", "delay_ticks", "drag_nspm", "inertia_nspm")]
    for name, period_s, delay, (drag, inertia) in measure_limits():
        rows.append((name, f"{period_s * 1e3:g}", delay, f"{drag:g}", f"{inertia:g}"))
        if tell is not None:
            tell(len(rows) - 1, 64)
    write_file(file, _csv(rows).encode())


def _cases_csv(swept: Swept) -> str:
    names = [f"{name}_{safety}" for safety in ("off", "on") for name in ("unstable", *MEASURES)]
    rows: list[Sequence[Any]] = [(*(field.name for field in fields(Case)), *names, *(f"{n}_on" for n in LIMITER_NAMES))]
    for off, on in zip(swept.off, swept.on, strict=True):
        row = list(astuple(off.case))
        for verdict in (off, on):
            row += ["; ".join(verdict.reasons), *(f"{getattr(verdict, name):.4g}" for name in MEASURES)]
        rows.append((*row, *(f"{share:.4g}" for share in on.acted)))
    return _csv(rows)


def _csv(rows: Sequence[Sequence[Any]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def _markdown(swept: Swept, fidelities: Sequence[Fidelity]) -> str:
    lines = ("# Where it stays stable", "", "```", summary(swept, fidelities), "```", "", "![Map](map.png)", "")
    return "\n".join((*lines, *(f"- unstable with safety on: `{verdict.case}`" for verdict in swept.unstable), ""))
