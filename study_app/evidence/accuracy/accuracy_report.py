"""Accuracy over computation time as CSV, Markdown and a figure for the width of a page, also in grey.

The panels compare methods to compute one definition, models of a real liquid, and the force on the hand. Rounding
errors are in a separate strip, so that the other errors keep their resolution.
"""

import math
import textwrap
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter

from study_app import figure_style as style
from study_app.evidence.accuracy.comparison import Accuracy, ActingError, Kind, Row, pareto_front, worst_rows
from study_app.evidence.reference_solutions import PERCEPTIBLE_N, RELATIVE, ROUNDING
from study_app.evidence.table import Evidence, Table, duration, plot_files

_WIDTH_PT: Final = 85 / 25.4 * 72
_LEFT_PT: Final = 27.0
_RIGHT_PT: Final = 6.0
_PANEL_PT: Final = 128.0
_STRIP_PT: Final = 54.0
_BREAK_PT: Final = 5.0
_HEADING_PT: Final = 11.0
_LINE_PT: Final = 9.0
_FOOT_PT: Final = 24.0
_SMALL: Final = 6.6
_LETTERS: Final = 66
_BUDGET_NS: Final = 1e6
_LABEL_PT: Final = 8.2
_COLUMN_NS: Final = 5e3
_SOLVER_HIGH: Final = 0.38
_SLANT_PT: Final = 4.0
"""Rise of labels per decade of time, so that hairlines from the left pass below the points to the right."""

_ROUNDED: Final = 1e-5
"""Errors below this proportion of the force are rounding errors, which are drawn in a separate strip."""

_LOOKS: Final[dict[str, dict[str, Any]]] = {
    "tick": {"marker": "o", "facecolor": "#0b65a3"},
    "list": {"marker": "s", "facecolor": "#13202c"},
    "rate": {"marker": "^", "facecolor": "#ffffff"},
    "estimator": {"marker": "D", "facecolor": "#f0a04b"},
    "law": {"marker": "o", "facecolor": "#ffffff"},
    "effects": {"marker": "o", "facecolor": "#0b65a3"},
}


@style.own_settings(style.PLOT_SETTINGS)
def draw(accuracy: Accuracy) -> Figure:
    """Draw a panel for each kind of reference and one for the force on the hand, with a legend below."""
    kinds: tuple[Kind, ...] = ("numerical", "physical")
    panels = [_Panel(accuracy, kind) for kind in kinds if accuracy.of(kind)]
    columns = len(panels) + bool(accuracy.acting)
    notes = " ".join(f"{note[0].upper()}{note[1:]}." for note in accuracy.notes)
    legend_lines = textwrap.wrap(_LEGEND + notes, columns * _LETTERS)
    height_pt = max(panel.height_pt for panel in panels) + _FOOT_PT + _LINE_PT * len(legend_lines)
    figure = Figure(figsize=(columns * _WIDTH_PT / 72, height_pt / 72), facecolor="white")
    subfigures = figure.subfigures(1, columns, wspace=0, squeeze=False)[0]
    shortest_ns, longest_ns = _time_span(accuracy)
    for panel, subfigure in zip(panels, subfigures, strict=False):
        panel.draw(subfigure, height_pt, (shortest_ns, longest_ns))
    if accuracy.acting:
        _draw_acting(subfigures[-1], accuracy, height_pt)
    figure.text(
        4 / (columns * _WIDTH_PT),
        (_LINE_PT * len(legend_lines) + 4) / height_pt,
        "\n".join(legend_lines),
        va="top",
        fontsize=_SMALL,
        color=style.TEXT_SOFT,
        linespacing=1.2,
    )
    return figure


_LEGEND: Final = (
    "Points show each model's largest error across its references; a thin line extends to the smallest. The ring marks "
    "the model that the program uses. For each connected model, no other model is both faster and more accurate. The "
    "effect of fewer ticks per second on stability is not shown. "
)


def _time_span(accuracy: Accuracy) -> tuple[float, float]:
    times = [row.ns_per_ms for row in accuracy.rows] + [
        truth.computing_s * 1e6 for truth in accuracy.truths if truth.computing_s
    ]
    return min(times) / 2, max(*times, _BUDGET_NS) * 4


_ACTING_TOP_PT: Final = 58.0
_SAME_LABEL: Final = 1.3
"""Points within this factor share a label."""


def _draw_acting(figure: FigureBase, accuracy: Accuracy, height_pt: float) -> None:
    """Draw the error of the force on the hand against the time of a tick, by estimator and delay."""
    _write_heading(
        figure,
        "Error of the force on the hand, including the delay",
        f"{accuracy.acting_liquid}; a typical hand moves a 0.2 kg handle randomly, at about 1.6 Hz and with the power "
        "of a ±20 mm oscillation. Numbers are ticks of delay; bars show the best linear estimator from positions.",
        height_pt,
    )
    axes = _axes_at(figure, _ACTING_TOP_PT, _PANEL_PT, height_pt)
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(FixedLocator([1, 2, 5, 10, 20, 50, 100, 200, 500]))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.minorticks_off()
    axes.tick_params(labelsize=_SMALL, pad=2)
    axes.set_title("Error [% of the force]", fontsize=_SMALL, pad=4, x=-0.075)
    axes.set_xlabel("Computation time per tick [ns]", fontsize=_SMALL + 0.4, labelpad=2)
    estimators = tuple(dict.fromkeys(error.estimator for error in accuracy.acting))  # cheapest first
    times = [error.ns for error in accuracy.acting]
    margin_ns = 0.25 * (max(times) - min(times)) + 5
    axes.set_xlim(min(times) - 2 * margin_ns, max(times) + 2 * margin_ns)
    offset: dict[str, Any] = {"textcoords": "offset points", "fontsize": _SMALL}
    for k, name in enumerate(estimators):
        points = sorted((error for error in accuracy.acting if error.estimator == name), key=lambda error: error.error)
        ns = float(np.median([error.ns for error in points]))
        axes.plot([ns] * len(points), [error.error for error in points], color=style.ZERO, linewidth=1.2, zorder=2)
        labelled: list[list[ActingError]] = []
        for error in points:
            axes.scatter(
                ns, error.error, s=17, zorder=4, edgecolor=style.TEXT, linewidth=0.7, **_ESTIMATOR_LOOKS[k % 3]
            )
            axes.scatter(ns, error.least, s=60, marker="_", color=style.TEXT, linewidth=1.0, zorder=3)
            if labelled and error.error < _SAME_LABEL * labelled[-1][0].error:
                labelled[-1].append(error)
            else:
                labelled.append([error])
        for group in labelled:
            text = ", ".join(map(str, sorted(error.delay for error in group)))
            height = math.sqrt(group[0].error * group[-1].error)
            axes.annotate(text, (ns, height), (5, 0), va="center", **offset)
        height = math.sqrt(points[0].error * points[-1].error)
        axes.annotate(name, (ns, height), (-6, 0), ha="right", va="center", fontweight="bold", **offset)
    axes.set_ylim(*_acting_range(accuracy))


def _acting_range(accuracy: Accuracy) -> tuple[float, float]:
    values = [value for error in accuracy.acting for value in (error.error, error.least)]
    return min(values) / 1.5, max(values) * 2


_ESTIMATOR_LOOKS: Final[tuple[dict[str, Any], ...]] = (
    {"marker": "o", "facecolor": "#0b65a3"},
    {"marker": "D", "facecolor": "#f0a04b"},
    {"marker": "s", "facecolor": "#ffffff"},
)


def _write_heading(figure: FigureBase, heading: str, text: str, height_pt: float) -> None:
    """Write a panel's heading, and its text in lines below."""
    lines = "\n".join(textwrap.wrap(text, _LETTERS))
    figure.text(4 / _WIDTH_PT, 1 - 6 / height_pt, heading, va="top", fontweight="bold")
    below_heading = 1 - (6 + _HEADING_PT) / height_pt
    figure.text(4 / _WIDTH_PT, below_heading, lines, va="top", fontsize=_SMALL, color=style.TEXT_SOFT)


def _axes_at(figure: FigureBase, top_pt: float, tall_pt: float, height_pt: float) -> Axes:
    """Return axes of a column's width, ``top_pt`` below its upper edge."""
    width = (_WIDTH_PT - _LEFT_PT - _RIGHT_PT) / _WIDTH_PT
    return figure.add_axes((_LEFT_PT / _WIDTH_PT, 1 - (top_pt + tall_pt) / height_pt, width, tall_pt / height_pt))


class _Panel:
    """The plot of all candidates against one kind of reference."""

    def __init__(self, accuracy: Accuracy, kind: Kind) -> None:
        rows = accuracy.of(kind)
        self._points = worst_rows(rows)
        self._rows = rows
        self._front = [self._points[candidate] for candidate in pareto_front(self._points)]
        self._solved = [truth.computing_s * 1e6 for truth in accuracy.truths if truth.computing_s]
        self._numerical = kind == "numerical"
        self._strip = [row for row in self._points.values() if row.error.rms < _ROUNDED]
        names = ", ".join(dict.fromkeys(row.truth for row in rows))
        if self._numerical:
            self._heading = "Numerical error, relative to exact sums"
            text = f"{rows[0].liquid}, {accuracy.motion}; drag{' and wake' if self._strip[1:] else ''} summed exactly"
        else:
            self._heading = "Physical error, relative to references"
            text = f"{rows[0].liquid}; {names}"
        self._text = text
        self._top_pt = 6 + _HEADING_PT + _LINE_PT * len(textwrap.wrap(text, _LETTERS)) + 13

    @property
    def height_pt(self) -> float:
        return self._top_pt + _PANEL_PT + (_STRIP_PT + _BREAK_PT if self._strip else 0.0) + 12

    def draw(self, figure: FigureBase, height_pt: float, span: tuple[float, float]) -> None:
        _write_heading(figure, self._heading, self._text, height_pt)
        top_pt = self._top_pt
        main = _axes_at(figure, top_pt, _PANEL_PT, height_pt)
        axes = [main]
        if self._strip:
            axes.append(_axes_at(figure, top_pt + _PANEL_PT + _BREAK_PT, _STRIP_PT, height_pt))
        for panel_axes in axes:
            self._set_up_axes(panel_axes, span, lowest=panel_axes is axes[-1])
        self._draw_points(main)
        if self._strip:
            self._draw_rounding_errors(axes[1], main)

    def _set_up_axes(self, axes: Axes, span: tuple[float, float], *, lowest: bool) -> None:
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlim(*span)
        axes.xaxis.set_major_locator(FixedLocator([10.0**power for power in range(0, 13)]))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda ns, _: duration(ns)))
        axes.minorticks_off()
        axes.tick_params(labelsize=_SMALL, labelbottom=lowest, length=2.5 if lowest else 0, axis="x", pad=2)
        axes.tick_params(labelsize=_SMALL, axis="y", pad=1)
        axes.spines["bottom"].set_visible(lowest)
        axes.axvline(_BUDGET_NS, color=style.TEXT, linewidth=0.8, linestyle=(0, (1, 1.5)))
        if lowest:
            label = "Time taken to compute 1 ms of motion (one tick at 1 kHz)"
            axes.set_xlabel(label, fontsize=_SMALL + 0.4, labelpad=2)
        for row, other in zip(self._front, self._front[1:], strict=False):
            times, errors = (row.ns_per_ms, other.ns_per_ms), (100 * row.error.rms, 100 * other.error.rms)
            axes.plot(times, errors, color=style.ZERO, linewidth=1.2, zorder=2)

    def _draw_points(self, axes: Axes) -> None:
        """Draw the points with error bars, their labels, and the accuracy target."""
        shown = [row for row in self._points.values() if row.error.rms >= _ROUNDED]
        target = 100 * min(row.error.target for row in self._rows)
        lows = [100 * row.error.rms for row in self._rows if row.error.rms >= _ROUNDED]
        axes.set_ylim(min(*lows, target) / 2, max(*lows, target) * 1.6)
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.set_title("Error [% of the force]", fontsize=_SMALL, pad=4, x=-0.075)
        axes.axhline(target, color=style.TEXT, linewidth=0.9, linestyle=(0, (5, 2)))
        proportion = f"{100 * RELATIVE:g} %" if target <= 100 * RELATIVE else f"{PERCEPTIBLE_N:g} N"
        offset: dict[str, Any] = {"textcoords": "offset points", "fontsize": _SMALL}
        axes.annotate(f"target {proportion}", (axes.get_xlim()[0], target), (3, 2), va="bottom", **offset)
        axes.annotate("1 ms", (_BUDGET_NS, axes.get_ylim()[1]), (2, 0), va="top", **offset)
        for row in shown:
            self._draw_point(axes, row)
            minimum = min(100 * other.error.rms for other in self._rows if other.candidate is row.candidate)
            axes.plot(
                [row.ns_per_ms] * 2, [minimum, 100 * row.error.rms], color=style.TEXT_SOFT, linewidth=0.6, zorder=3
            )
        self._draw_labels(axes, shown)
        if self._solved and not self._numerical:
            minimum, greatest = min(self._solved), max(self._solved)
            axes.axvspan(
                minimum, greatest, 0, _SOLVER_HIGH, facecolor=style.GRID, edgecolor=style.TEXT_SOFT, linewidth=0.8
            )
            foot = (minimum, axes.get_ylim()[0])
            axes.annotate("fluid solver", foot, (-2, 3), rotation=90, ha="right", va="bottom", **offset)

    def _draw_rounding_errors(self, axes: Axes, main: Axes) -> None:
        errors = [max(100 * row.error.rms, 1e-15) for row in self._strip]
        axes.set_ylim(10.0 ** (np.floor(np.log10(min(errors))) - 4), 100 * _ROUNDED * 10)
        axes.yaxis.set_major_locator(FixedLocator([1e-12, 1e-8, 1e-4]))
        for row in self._strip:
            self._draw_point(axes, row)
            weight = "bold" if row.chosen else "normal"
            point = (row.ns_per_ms, 100 * row.error.rms)
            axes.annotate(row.candidate.label, point, fontsize=_SMALL, fontweight=weight, **self._label_position(row))
        for marked_axes, edge in ((main, 0.0), (axes, 1.0)):
            slash: dict[str, Any] = {
                "transform": marked_axes.transAxes,
                "color": style.AXIS,
                "clip_on": False,
                "linewidth": 0.6,
            }
            marked_axes.plot([-0.012, 0.012], [edge - 0.01, edge + 0.01], **slash)

    def _label_position(self, row: Row) -> dict[str, Any]:
        lists = sorted(
            (
                row_of_strip
                for row_of_strip in self._strip
                if not row_of_strip.chosen and row_of_strip.error.rms < ROUNDING
            ),
            key=_time_ns,
        )
        if row.chosen:
            return {"xytext": (0, -6), "textcoords": "offset points", "ha": "center", "va": "top"}
        if row in lists[1::2]:
            return {"xytext": (0, -4), "textcoords": "offset points", "ha": "center", "va": "top"}
        side = "right" if row in lists[1:] else "center"
        return {"xytext": (4 if side == "right" else 0, 4), "textcoords": "offset points", "ha": side, "va": "bottom"}

    def _draw_point(self, axes: Axes, row: Row) -> None:
        marker_style = _LOOKS[row.candidate.family]
        point = (row.ns_per_ms, 100 * row.error.rms)
        if row.chosen:
            axes.scatter(*point, s=74, marker="o", facecolor="none", edgecolor=style.TEXT, linewidth=1.1, zorder=5)
        axes.scatter(*point, s=17, edgecolor=style.TEXT, linewidth=0.7, zorder=4, **marker_style)

    def _draw_labels(self, axes: Axes, shown: Sequence[Row]) -> None:
        """Label the points: those at lower rates next to them, the others in a column, joined by thin lines."""
        low, high = np.log(axes.get_ylim())
        at_point = [row for row in shown if row.candidate.family == "rate"]
        for row in at_point:
            point = (row.ns_per_ms, 100 * row.error.rms)
            axes.annotate(row.candidate.label, point, (5, 0), textcoords="offset points", va="center", fontsize=_SMALL)
        point_pt = {
            row: (np.log(_error_percent(row)) - low) / (high - low) * _PANEL_PT for row in shown if row not in at_point
        }
        ordered = sorted(point_pt, key=lambda row: point_pt[row] + _SLANT_PT * np.log10(row.ns_per_ms))
        wanted_pt = [point_pt[row] for row in ordered]
        column_ns = max(_COLUMN_NS, *(2.2 * row.ns_per_ms for row in ordered))
        for row, label_pt in zip(ordered, _spread_apart(wanted_pt, _LABEL_PT, _PANEL_PT), strict=True):
            height = float(np.exp(low + label_pt / _PANEL_PT * (high - low)))
            axes.annotate(
                row.candidate.label,
                (row.ns_per_ms, _error_percent(row)),
                (column_ns, height),
                va="center",
                fontsize=_SMALL,
                fontweight="bold" if row.chosen else "normal",
                arrowprops={
                    "arrowstyle": "-",
                    "linewidth": 0.4,
                    "color": style.ZERO,
                    "shrinkA": 1,
                    "shrinkB": 3,
                    "relpos": (0, 0.5),
                },
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.4},
            )


def _time_ns(row: Row) -> float:
    return row.ns_per_ms


def _error_percent(row: Row) -> float:
    return 100 * row.error.rms


def _spread_apart(desired: Sequence[float], gap: float, greatest: float) -> list[float]:
    """Return positions close to ``desired``, in the same order, at least ``gap`` apart and at most ``greatest``."""
    positions: list[float] = []
    for position in desired:
        positions.append(max(position, positions[-1] + gap) if positions else position)
    ceiling = greatest
    for k in range(len(positions) - 1, -1, -1):
        positions[k] = min(positions[k], ceiling)
        ceiling = positions[k] - gap
    return positions


COLUMNS: Final = (
    "kind", "liquid", "truth", "model", "median_ns", "p99_ns", "ns_per_ms", "rms_error_n", "max_error_n",
    "rms_error_percent", "max_error_percent", "direction_error_deg", "target_percent", "memory_bytes",
    "rate_hz", "ticks_per_s", "times_real_time", "batches", "pareto_front", "gate_choice",
)  # fmt: skip


def _csv_row(row: Row) -> tuple[str | float, ...]:
    ticks_per_s = 1e9 / row.time.median_ns
    error = row.error
    return (
        *(row.kind, row.liquid, row.truth, row.candidate.name),
        *(row.time.median_ns, row.time.p99_ns, row.ns_per_ms),
        *(error.rms_n, error.most_n, 100 * error.rms, 100 * error.most, error.direction_deg, 100 * error.target),
        *(row.memory_bytes, row.candidate.rate_hz, ticks_per_s, ticks_per_s / row.candidate.rate_hz, row.time.batches),
        *(int(row.on_front), int(row.chosen)),
    )


def accuracy_evidence(accuracy: Accuracy) -> Evidence:
    """Return the tables (Markdown with the source of each reference, and CSV) and the figure."""
    parts = [f"Machine: {accuracy.machine}.", f"Motion: {accuracy.motion}.", _WHAT]
    parts += [accuracy.plain_c] if accuracy.plain_c else []
    parts += [f"**{truth.name}**: {truth.source}." for truth in accuracy.truths]
    parts += [f"Note: {note}." for note in accuracy.notes]
    for truth in accuracy.truths:
        rows = [row for row in accuracy.rows if row.truth == truth.name]
        parts.append(f"## Against the {truth.name} ({rows[0].kind}), {rows[0].liquid}\n\n" + _markdown_table(rows))
    if accuracy.acting:
        acting = [
            (
                error.estimator,
                error.delay,
                _format_count(error.ns),
                _format_digits(error.error),
                _format_digits(error.least),
            )
            for error in accuracy.acting
        ]
        headings = ("estimator", "ticks of delay", "ns per tick", "error [%]", "best linear estimator [%]")
        parts.append(
            f"## The force on the hand, {accuracy.acting_liquid}\n\n{Table(headings, acting, left=1).markdown()}"
        )
    text = "\n\n".join(parts) + "\n"
    cells = [
        [f"{value:.6g}" if isinstance(value, float) else value for value in _csv_row(row)] for row in accuracy.rows
    ]
    files = {"accuracy.csv": Table(COLUMNS, cells).csv(), "accuracy.md": text}
    return Evidence(text, files, plot_files("accuracy", "Accuracy and computation time", draw, accuracy))


_WHAT: Final = (
    "Times are the processor time of one thread: the median and the 99th percentile of batches of 1,000 ticks. Each "
    "value is the median of the repeats in one interleaved run. RMS errors are given as a percentage of the RMS "
    "reference force, and maximum errors as a percentage of the maximum reference force. Direction is the RMS "
    "angular error while the reference force is perceptible. Rows with fewer ticks per second show only the force "
    "error, not the effect on stability. For each motion from the fluid solver, the unsteady-drag constants were "
    "fitted to the other motions. ●: no other model is both faster and more accurate, based on each model's largest "
    "error; ◎: the model that the program uses."
)
_HEADINGS: Final = (
    "", "model", "ns per tick", "p99", "RMS error [N]", "max [N]", "RMS [%]", "max [%]", "direction [°]",
    "memory [kB]", "ticks per second", "times real time",
)  # fmt: skip


def _markdown_table(rows: Sequence[Row]) -> str:
    table = [_HEADINGS, (":-:", ":--", *["--:"] * (len(_HEADINGS) - 2))]
    for row in rows:
        ticks_per_s = 1e9 / row.time.median_ns
        error = row.error
        mark = "◎" if row.chosen else ("●" if row.on_front else "")
        table.append(
            (
                mark,
                row.candidate.name.replace("C_d", "C<sub>d</sub>"),
                _format_count(row.time.median_ns),
                _format_count(row.time.p99_ns),
                *(_format_digits(value) for value in (error.rms_n, error.most_n, 100 * error.rms, 100 * error.most)),
                _format_digits(error.direction_deg),
                _format_digits(row.memory_bytes / 1e3),
                _format_count(ticks_per_s),
                _format_count(ticks_per_s / row.candidate.rate_hz),
            )
        )
    return "\n".join(f"| {' | '.join(cells)} |" for cells in table)


def _format_count(value: float) -> str:
    if not math.isfinite(value):
        return "–"
    digits = 0 if value == 0 else 2 - math.floor(math.log10(abs(value)))
    return f"{round(value, digits):,.{max(digits, 0)}f}" if value < 100 else f"{round(value, digits):,.0f}"


def _format_digits(value: float) -> str:
    if not math.isfinite(value):
        return "–"
    if value != 0 and abs(value) < 1e-4:
        return f"{value:.0e}"
    return f"{float(f'{value:.2g}'):,g}"
