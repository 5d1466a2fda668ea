"""The error of the visual delay for each requested delay, as text, Markdown, CSV and a figure.

The error of a frame is the time from the drawn sample to the end of its painting, or to the surface's swap, minus the
requested delay. It includes ``session.trial.SETTLED_S``, which is the same at every delay. The figure has one panel per
screen, with the loads side by side; ½ frame and 1 frame are marked.
"""

import itertools
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from study_app import figure_style as style
from study_app.evidence.computer import LoadName
from study_app.evidence.table import Evidence, Table, plot_files
from study_app.evidence.timing.report import Layout, panels_abreast

DELAYS_S: Final = (0.0, 0.05, 0.075, 0.1, 0.125, 0.15, 0.2)
"""The delays of ``protocols/rek2024.toml``."""
VIRTUAL_HZ: Final = (60.0, 144.0)

BESIDE: Final[dict[LoadName, str]] = {
    "none": "tank alone",
    "gui": "with the operator's window",
    "gui+cpu": "with the operator's window and busy cores",
}

_MEAN_FRAMES: Final = 0.5
_TAIL_FRAMES: Final = 1.0
_TAIL_PERCENT: Final = 99.0


@dataclass(frozen=True, slots=True)
class Shown:
    """The frames of one trial: their paint or swap times and the times that they show [ns] (n,).

    ``screen`` names the screen, ``paced`` the source of the frame timing, ``load`` the concurrent load.
    """

    screen: str
    paced: str
    load: LoadName
    refresh_hz: float
    delay_s: float
    painted_ns: NDArray[np.int64]
    sample_ns: NDArray[np.int64]

    @property
    def frames(self) -> int:
        return len(self.painted_ns)

    @property
    def errors_ms(self) -> NDArray[np.float64]:
        """Achieved minus requested delay of each frame [ms] (n,)."""
        ages_ms = np.asarray(self.painted_ns - self.sample_ns, np.float64) * 1e-6
        return np.asarray(ages_ms - 1e3 * self.delay_s, np.float64)

    @property
    def frame_ms(self) -> float:
        """The refresh period of the screen [ms]."""
        return 1e3 / self.refresh_hz

    @property
    def achieved_ms(self) -> float:
        return 1e3 * self.delay_s + self.mean_ms

    @property
    def mean_ms(self) -> float:
        return float(self.errors_ms.mean())

    @property
    def worst_ms(self) -> float:
        return float(self.errors_ms.max())

    def percentile_ms(self, percent: float) -> float:
        return float(np.percentile(self.errors_ms, percent))

    @property
    def late(self) -> int:
        """The number of frames shown more than one refresh later than requested."""
        return int((self.errors_ms > self.frame_ms).sum())

    @property
    def missed(self) -> int:
        """The number of refreshes without a new frame between the first frame and the last."""
        gaps = np.rint(np.diff(self.painted_ns) * 1e-6 / self.frame_ms)
        return int(np.maximum(gaps - 1, 0).sum())

    @property
    def held(self) -> bool:
        """Whether the mean error is at most half a refresh, and its 99th percentile at most one."""
        return (
            abs(self.mean_ms) <= _MEAN_FRAMES * self.frame_ms
            and self.percentile_ms(_TAIL_PERCENT) <= _TAIL_FRAMES * self.frame_ms
        )


@dataclass(frozen=True, slots=True)
class Delayed:
    """The results of one run, trial by trial; ``size_px`` is the size of the window on a virtual screen."""

    machine: str
    seconds: float
    size_px: tuple[int, int]
    shown: tuple[Shown, ...]

    @property
    def screens(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(column.screen for column in self.shown))

    @property
    def loads(self) -> tuple[LoadName, ...]:
        return tuple(dict.fromkeys(column.load for column in self.shown))

    def on(self, screen: str, load: LoadName) -> tuple[Shown, ...]:
        """Return the trials on a screen under a load, from the shortest delay to the longest."""
        trials = (column for column in self.shown if (column.screen, column.load) == (screen, load))
        return tuple(sorted(trials, key=lambda trial: trial.delay_s))

    def limits(self) -> tuple[str, ...]:
        """Return the limits for each screen and load, and whether they are met."""
        return tuple(self._describe_errors(screen, load) for screen in self.screens for load in self.loads)

    def _describe_errors(self, screen: str, load: LoadName) -> str:
        trials = self.on(screen, load)
        mean = max(abs(trial.mean_ms) / trial.frame_ms for trial in trials)
        tail = max(trial.percentile_ms(_TAIL_PERCENT) / trial.frame_ms for trial in trials)
        means_ms = [trial.mean_ms for trial in trials]
        return (
            f"{screen}, {BESIDE[load]}: mean error at most {mean:.2f} of a frame (limit {_MEAN_FRAMES:g}), "
            f"99th percentile at most {tail:.2f} (limit {_TAIL_FRAMES:g}), "
            f"means within {max(means_ms) - min(means_ms):.2f} ms of each other: "
            f"{'met' if all(trial.held for trial in trials) else 'missed'}"
        )


_LAYOUT: Final = Layout(height_pt=212, top_pt=46, left_pt=34, gap_pt=46, right_pt=44)
_MAX_FRAMES: Final = 1.5  # limit of the axis; values beyond it are written at its top
_LOAD_SPACING: Final = 0.34

_LOOKS: Final[dict[LoadName, dict[str, Any]]] = {
    "none": {"color": "#0b65a3", "marker": "o", "markerfacecolor": "#0b65a3"},
    "gui": {"color": "#b35600", "marker": "^", "markerfacecolor": "white"},
    "gui+cpu": {"color": "#7a3e8f", "marker": "D", "markerfacecolor": "white"},
}


@style.own_settings(style.PLOT_SETTINGS)
def draw(delays: Delayed) -> Figure:
    """Draw the delay errors of all trials."""
    width, height = delays.size_px
    caption = (
        f"Marks show the mean of all frames; lines extend to the {_TAIL_PERCENT:g}th percentile, whose value is "
        f"printed if it is off the scale. {delays.seconds:g} s of reaching at each delay, with the tank at {width} × "
        f"{height}; measured from the drawn sample to the end of painting. {delays.machine}."
    )
    handles = [
        Line2D([], [], markersize=4.5, linewidth=1.3, label=BESIDE[load].capitalize(), **_LOOKS[load])
        for load in delays.loads
    ]
    figure, panels = panels_abreast(_LAYOUT, len(delays.screens), handles, 2.6, caption)
    for axes, screen in zip(panels, delays.screens, strict=True):
        _draw_panel(axes, delays, screen, first=axes is panels[0])
    return figure


def _draw_panel(axes: Axes, delays: Delayed, screen: str, *, first: bool) -> None:
    """Draw every trial on a screen: a marker at the mean, and a line from it to the 99th percentile."""
    frame_ms = delays.on(screen, delays.loads[0])[0].frame_ms
    top_ms = _MAX_FRAMES * frame_ms
    for number, load in enumerate(delays.loads):
        offset = _LOAD_SPACING * (number - (len(delays.loads) - 1) / 2)
        for index, trial in enumerate(delays.on(screen, load)):
            _draw_trial(axes, trial, index + offset, top_ms)
    for proportion, text in ((0.5, "½ frame"), (1.0, "1 frame")):
        axes.axhline(proportion * frame_ms, color=style.ZERO, linewidth=0.8, linestyle=(0, (1, 1.5)), zorder=1)
        axes.annotate(
            text,
            (1.0, proportion * frame_ms),
            (3, 0),
            xycoords=("axes fraction", "data"),
            textcoords="offset points",
            va="center",
            fontsize=6.6,
        )
    delays_ms = [1e3 * trial.delay_s for trial in delays.on(screen, delays.loads[0])]
    axes.set_xticks(range(len(delays_ms)), [f"{delay_ms:g}" for delay_ms in delays_ms])
    axes.set_xlim(-0.6, len(delays_ms) - 0.4)
    axes.set_ylim(0, top_ms)
    axes.tick_params(labelsize=6.6)
    axes.set_xlabel("requested delay [ms]", fontsize=7, labelpad=2)
    if first:
        axes.set_ylabel("later than requested [ms]", fontsize=7, labelpad=2)
    paced = delays.on(screen, delays.loads[0])[0].paced
    axes.set_title(f"{screen[0].upper()}{screen[1:]}, {paced}", pad=13, color=style.TEXT)


def _draw_trial(axes: Axes, trial: Shown, x: float, top_ms: float) -> None:
    look = _LOOKS[trial.load]
    tail_ms = trial.percentile_ms(_TAIL_PERCENT)
    axes.plot([x, x], [trial.mean_ms, min(tail_ms, top_ms)], color=look["color"], linewidth=1.3, zorder=4)
    if tail_ms < top_ms:
        axes.plot([x - 0.09, x + 0.09], [tail_ms, tail_ms], color=look["color"], linewidth=1.3, zorder=4)
    else:
        axes.annotate(
            f"{tail_ms:.0f}",
            (x, top_ms),
            (0, 1),
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=6.0,
            color=look["color"],
            annotation_clip=False,
        )
    axes.plot([x], [np.clip(trial.mean_ms, 0, top_ms)], markersize=4.5, zorder=5, clip_on=False, **look)


COLUMNS: Final = (
    "screen", "frames_follow", "load", "requested_ms", "achieved_ms", "frames", "error_mean_ms", "error_p50_ms",
    "error_p95_ms", "error_p99_ms", "error_max_ms", "error_mean_frames", "error_p50_frames", "error_p95_frames",
    "error_p99_frames", "error_max_frames", "late", "refreshes_missed",
)  # fmt: skip
_PERCENTILES: Final = (50.0, 95.0, 99.0)
_HEADINGS: Final = (
    "requested", "achieved", *("mean", "p95", "p99", "worst") * 2, "late", "missed",
)  # fmt: skip


def delays_evidence(delays: Delayed) -> Evidence:
    """Return the report for a terminal, as Markdown between comments for docs/timing.md, as CSV, and the figure."""
    width, height = delays.size_px
    head = (
        f"{delays.seconds:g} s of reaching at each delay, with the tank at {width} × {height}; error: achieved "
        "minus requested delay, from the drawn sample to the end of painting; late: more than one frame late. "
        f"{delays.machine}."
    )
    lines = [head]
    for screen, load in itertools.product(delays.screens, delays.loads):
        trials = delays.on(screen, load)
        lines += ["", f"{screen} ({trials[0].paced}), {BESIDE[load]}: errors in ms, then in frames", ""]
        lines.append(Table(_HEADINGS, [_table_row(trial) for trial in trials]).text())
    text = "\n".join((*lines, "", *delays.limits())) + "\n"
    abreast = [
        trials
        for screen in delays.screens
        for trials in zip(*(delays.on(screen, load) for load in delays.loads), strict=True)
    ]
    column_heads = [
        f"{BESIDE[load]}: mean" if name == "mean" else name
        for load in delays.loads
        for name in ("mean", "p95", "p99", "worst", "late")
    ]
    rows = [
        (
            trials[0].screen,
            f"{1e3 * trials[0].delay_s:g}",
            *(cell for trial in trials for cell in (*_error_texts(trial), _late_text(trial))),
        )
        for trials in abreast
    ]
    table = Table(("screen", "requested", *column_heads), rows, left=1).markdown()
    limits = "\n".join(f"- {limit}" for limit in delays.limits())
    files = {
        "delays.txt": text,
        "delays.md": f"{head} Errors in ms.\n\n{table}\n\n{limits}\n",
        "delays.csv": Table(COLUMNS, [_csv_row(trial) for trial in delays.shown]).csv(),
    }
    return Evidence(text, files, plot_files("delays", "Accuracy of visual delays", draw, delays))


def _csv_row(trial: Shown) -> tuple[object, ...]:
    errors_ms = (trial.mean_ms, *map(trial.percentile_ms, _PERCENTILES), trial.worst_ms)
    return (
        *(trial.screen, trial.paced, trial.load),
        *(f"{1e3 * trial.delay_s:g}", f"{trial.achieved_ms:.3f}", trial.frames),
        *(f"{error_ms:.3f}" for error_ms in errors_ms),
        *(f"{error_ms / trial.frame_ms:.4f}" for error_ms in errors_ms),
        *(trial.late, trial.missed),
    )


def _table_row(trial: Shown) -> tuple[str, ...]:
    return (
        f"{1e3 * trial.delay_s:g}",
        f"{trial.achieved_ms:.1f}",
        *_error_texts(trial),
        *(f"{error_ms / trial.frame_ms:.2f}" for error_ms in _error_measures_ms(trial)),
        _late_text(trial),
        f"{trial.missed}",
    )


def _late_text(trial: Shown) -> str:
    return f"{trial.late} of {trial.frames}"


def _error_texts(trial: Shown) -> tuple[str, ...]:
    return tuple(f"{error_ms:.1f}" for error_ms in _error_measures_ms(trial))


def _error_measures_ms(trial: Shown) -> tuple[float, ...]:
    """Return mean, 95th and 99th percentile, and maximum [ms]."""
    return trial.mean_ms, trial.percentile_ms(95), trial.percentile_ms(99), trial.worst_ms
