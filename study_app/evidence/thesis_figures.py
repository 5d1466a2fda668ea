"""Figures 3 to 8 of the thesis, redrawn: force over time per axis, computed by the servo's own tick.

They show programmed motions through the default liquid of the thesis' evaluation (Rek 2024, §5.1): density 1000 kg/m³,
a ball of 68 mm, N = S = 5000, y = 1, λ = 0.999975, breaking angle 45° between neighbouring elements. The speed is 1
m/s, and velocities are exact.
"""

import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from study_app import figure_style as style
from study_app.haptics.model.effects import Wake
from study_app.haptics.model.motion import Motion, programmed_motion
from study_app.haptics.model.scene import Given, Liquid, Scene
from study_app.haptics.runtime.offline import Table, simulate
from study_app.store.files import make_folder, write_files

_RATE_HZ: Final = 1000.0
LENGTH: Final = 5000
_RESOLUTIONS_M: Final = (0.0, 1.5e-3, 3.5e-3)
"""Resolutions in Fig. 7 [m]: at 1 m/s every tick, every second tick and every fourth tick stores an element."""
EXPONENTS: Final = (0.25, 0.5, 1.0, 2.0, 4.0)


@dataclass(frozen=True, eq=False)
class _Run:
    """One motion through one liquid; ``label`` names it in its figure."""

    label: str
    scene: Scene
    motion: Motion

    @cached_property
    def table(self) -> Table:
        """The simulated force and state, one row per tick (see ``offline.simulate``)."""
        return simulate(self.scene, self.motion)


@dataclass(frozen=True, eq=False)
class ThesisFigure:
    """The content of a figure: its runs, the times of events in them [s], and its statement."""

    number: int
    title: str
    caption: str
    runs: tuple[_Run, ...]
    events: tuple[tuple[float, str], ...] = ()

    @property
    def name(self) -> str:
        return f"figure-{self.number}"


def tank(**wake: Any) -> Scene:
    """Return the liquid of the thesis' evaluation; ``wake`` changes parameters of its tail."""
    tail = Wake(**{"length": LENGTH, "scaling": LENGTH, "breaking_span_m": 0.0, **wake})
    return _scene(Liquid(id="liquid", density_kg_m3=1000, effects=("drag", "wake"), wake=tail))


def _scene(liquid: Liquid) -> Scene:
    return Scene(rate_hz=_RATE_HZ, velocity=Given(), liquids=(liquid,))


def figure_3() -> ThesisFigure:
    """Return Fig. 3: three circles with drag alone."""
    motion = programmed_motion("circle", rate_hz=_RATE_HZ)
    return ThesisFigure(
        3,
        "Three circles, drag alone",
        "The body makes three circles at constant speed and then stops. With drag alone, the force has a constant "
        "magnitude, always opposes the motion, and is zero on the tick after the stop.",
        (_Run("drag", _scene(Liquid(id="liquid", density_kg_m3=1000)), motion),),
        ((_stop_s(motion), "stop"),),
    )


def figure_4() -> ThesisFigure:
    """Return Fig. 4: three circles with the wake."""
    motion = programmed_motion("circle", rate_hz=_RATE_HZ)
    return ThesisFigure(
        4,
        "Three circles, drag and wake",
        "The same motion with the wake. The liquid is gradually set in motion: while the tail fills, the relative "
        "speed falls linearly and the force falls as its square. After the stop, the liquid continues to push in the "
        "direction of the previous motion, at first slightly less strongly than the drag; the force falls to zero as "
        "the tail empties.",
        (_Run("drag and wake", tank(), motion),),
        ((_stop_s(motion), "stop"),),
    )


def figure_5() -> ThesisFigure:
    """Return Fig. 5: three circles, then motion against the flow."""
    motion = programmed_motion("reverse", rate_hz=_RATE_HZ)
    turn_s = _stop_s(programmed_motion("circle", rate_hz=_RATE_HZ))
    return ThesisFigure(
        5,
        "Three circles, then 2 s against the flow",
        "After the circles, the body reverses against the whirlpool that it has created: the force jumps far above "
        "the drag alone, falls as the tail takes on the new direction, and falls again after the stop.",
        (_Run("drag and wake", tank(), motion),),
        ((turn_s, "turn back"), (_stop_s(motion), "stop")),
    )


def _figure_6() -> ThesisFigure:
    """Return Fig. 6: steps with 90° turns, for two breaking angles."""
    motion = programmed_motion("zigzag", rate_hz=_RATE_HZ)
    return ThesisFigure(
        6,
        "Steps alternating by 90°",
        "The body moves toward −z in steps that alternate along x. With a breaking angle of 45°, every step begins a "
        "new segment, the directions partly cancel out, and the wake remains limited. With 100°, the whole path is "
        "one segment that always follows the newest direction, one tick late at each turn, and the force falls "
        "toward zero.",
        tuple(_Run(f"breaking angle {angle}°", tank(breaking_angle_deg=angle), motion) for angle in (45, 100)),
    )


def _figure_7() -> ThesisFigure:
    """Return Fig. 7: a straight line at three resolutions of the tail."""
    motion = programmed_motion("line", rate_hz=_RATE_HZ, moving_s=12.0)
    labels = ("every tick", "1.5 mm", "3.5 mm")
    return ThesisFigure(
        7,
        "A straight line at three resolutions of the tail",
        "The body moves in a straight line at constant speed. A coarser resolution stores fewer elements (here every "
        "second or every fourth tick), so the tail fills more slowly and the force falls later.",
        tuple(_Run(label, tank(resolution_m=step), motion) for label, step in zip(labels, _RESOLUTIONS_M, strict=True)),
    )


def figure_8() -> ThesisFigure:
    """Return Fig. 8: a straight line with five wake responses."""
    motion = programmed_motion("line", rate_hz=_RATE_HZ, moving_s=8.0)
    return ThesisFigure(
        8,
        "A straight line with five wake responses",
        "The body moves in a straight line at constant speed. The wake is proportional to the filled fraction of the "
        "tail raised to the power y: with y below 1, the force falls at once; with y = 4, it stays near the full "
        "drag for a long time and falls only near the end. Because its elements decay, every wake remains slightly "
        "slower than the body.",
        tuple(_Run(f"y = {exponent:g}", tank(exponent=exponent), motion) for exponent in EXPONENTS),
    )


FIGURES: Final[tuple[Callable[[], ThesisFigure], ...]] = (figure_3, figure_4, figure_5, _figure_6, _figure_7, figure_8)


def _stop_s(motion: Motion) -> float:
    """Return the time of the first tick after which the body is at rest [s]."""
    is_resting = ~np.diff(motion.position_m, axis=0).any(axis=1)
    return float(motion.t_s[int(np.argmax(is_resting))])


_PLOT_PT: Final = 128.0
_TOP_PT: Final = 46.0
_FOOT_PT: Final = 32.0
_LINE_PT: Final = 11.0
_SIDE_PT: Final = 30.0
_RIGHT_PT: Final = 16.0
_GAP_PT: Final = 40.0
_HEADING_PT: Final = 14.0
_CAPTION_LETTERS: Final = 118
_ARROW_S: Final = 2.75
_COMPONENTS: Final = {"x": ("fx_n", "right"), "y": ("fy_n", "up"), "z": ("fz_n", "toward you")}


def figures(to: Path) -> tuple[Path, ...]:
    """Write every figure as PNG, SVG and PDF, each with its caption as text, into the folder ``to``; return the files.

    The same version of the program writes the same bytes.

    Raises
    ------
    StoreError, AnalysisError
        The folder cannot be created or written.
    """
    make_folder(to, waits=False)
    files: dict[str, bytes] = {}
    for make in FIGURES:
        thesis_figure = make()
        figure = draw(thesis_figure)
        title = f"Fig. {thesis_figure.number}: {thesis_figure.title}"
        for kind in style.FORMATS:
            files[f"{thesis_figure.name}.{kind}"] = style.file_bytes(figure, kind, title, style.PLOT_SETTINGS)
        files[f"{thesis_figure.name}.txt"] = f"{title}. {thesis_figure.caption}\n".encode()
    return write_files(to, files)


@style.own_settings(style.PLOT_SETTINGS)
def draw(thesis_figure: ThesisFigure) -> Figure:
    """Draw one figure: title, force over time, the path or the liquid's speed, and caption."""
    caption = textwrap.wrap(thesis_figure.caption, _CAPTION_LETTERS)
    height_pt = _TOP_PT + _PLOT_PT + _FOOT_PT + _LINE_PT * len(caption)
    figure = Figure(figsize=(style.PAGE_WIDTH_PT / 72, height_pt / 72), facecolor="white")

    def write(left_pt: float, down_pt: float, text: str, **text_style: Any) -> None:
        figure.text(left_pt / style.PAGE_WIDTH_PT, 1 - down_pt / height_pt, text, va="top", **text_style)

    def add_axes(left_pt: float, width_pt: float) -> Axes:
        bottom = 1 - (_TOP_PT + _PLOT_PT) / height_pt
        return figure.add_axes(
            (left_pt / style.PAGE_WIDTH_PT, bottom, width_pt / style.PAGE_WIDTH_PT, _PLOT_PT / height_pt)
        )

    write(_SIDE_PT, 6, f"Fig. {thesis_figure.number}", fontsize=9, fontweight="bold")
    write(_SIDE_PT + 38, 6, thesis_figure.title, fontsize=9)
    write(_SIDE_PT, _TOP_PT + _PLOT_PT + _FOOT_PT - 6, "\n".join(caption), color=style.TEXT_SOFT, linespacing=1.25)
    if len(thesis_figure.runs) > 2:
        _draw_comparison(add_axes, thesis_figure)
    else:
        _draw_each_run(add_axes, thesis_figure)
    return figure


def _draw_each_run(add_axes: Callable[[float, float], Axes], thesis_figure: ThesisFigure) -> None:
    """Draw the force of each run in its own plot, and their common path."""
    path_pt = _PLOT_PT
    width_pt = (style.PAGE_WIDTH_PT - _SIDE_PT - path_pt - _RIGHT_PT) / len(thesis_figure.runs) - _GAP_PT
    plots = []
    for number, run in enumerate(thesis_figure.runs):
        plots.append(add_axes(_SIDE_PT + number * (width_pt + _GAP_PT), width_pt))
        _draw_components(plots[-1], run, thesis_figure.events, several=len(thesis_figure.runs) > 1)
    limits = np.array([plot.get_ylim() for plot in plots])
    for plot in plots:
        plot.set_ylim(limits[:, 0].min() * 1.08, limits[:, 1].max() * 1.08)
    _draw_path(add_axes(style.PAGE_WIDTH_PT - _RIGHT_PT - path_pt, path_pt), thesis_figure.runs[0])


def _draw_comparison(add_axes: Callable[[float, float], Axes], thesis_figure: ThesisFigure) -> None:
    """Draw the force of all runs along the straight motion, and the fraction of its speed that the liquid reaches."""
    width_pt = (style.PAGE_WIDTH_PT - _SIDE_PT - _GAP_PT - _RIGHT_PT) / 2
    force, liquid = add_axes(_SIDE_PT, width_pt), add_axes(_SIDE_PT + width_pt + _GAP_PT, width_pt)
    colours = style.STEPS if len(thesis_figure.runs) == len(style.STEPS) else style.STEPS[::2]
    for run, colour in zip(thesis_figure.runs, colours, strict=True):
        table = run.table
        force.plot(table.t_s, table.fx_n, color=colour, label=run.label)
        liquid.plot(table.t_s, table.wake_x_mps / table.vx_mps, color=colour, label=run.label)
    headings = ("Force along x [N]; along y and z it is zero", "Speed of the liquid relative to the body's speed")
    for axes, heading in zip((force, liquid), headings, strict=True):
        _set_up_time_axis(axes, float(thesis_figure.runs[0].table.t_s[-1]))
        axes.set_title(heading, pad=_HEADING_PT)
        _draw_legend(axes, shorter=len(thesis_figure.runs) > 3)


def _set_up_time_axis(axes: Axes, until_s: float) -> None:
    axes.set_xlim(0, until_s)
    axes.set_xlabel("Time [s]", loc="right", labelpad=1)
    axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    axes.yaxis.set_major_locator(MaxNLocator(5))
    axes.axhline(0, color=style.ZERO, linewidth=0.6, zorder=1)


def _draw_legend(axes: Axes, *, shorter: bool = False) -> None:
    """Draw the legend in a row below the heading, so that it never covers data."""
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(
        handles,
        labels,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=len(labels),
        frameon=False,
        handlelength=1.2 if shorter else 2.2,
        handletextpad=0.5,
        columnspacing=0.9 if shorter else 1.4,
        borderpad=0,
        borderaxespad=0.3,
    )


def _draw_components(axes: Axes, run: _Run, events: Sequence[tuple[float, str]], *, several: bool) -> None:
    """Draw the force of one run, one line per axis."""
    table = run.table
    _set_up_time_axis(axes, float(table.t_s[-1]))
    axes.set_title(f"Force [N], {run.label}" if several else "Force [N]", pad=_HEADING_PT)
    for name, (column, meaning) in _COMPONENTS.items():
        label = name if several else f"{name} ({meaning})"
        axes.plot(table.t_s, table[column], **style.AXES[name], label=label)
    _draw_legend(axes)
    for time_s, word in events:
        axes.axvline(time_s, color=style.AXIS, linewidth=0.7, linestyle=(0, (3, 2)))
        at_foot: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "textcoords": "offset points"}
        axes.annotate(word, (time_s, 0), xytext=(3, 3), color=style.TEXT_SOFT, **at_foot)


def _draw_path(axes: Axes, run: _Run) -> None:
    colour = style.TEXT_SOFT
    x_m, z_m = run.motion.position_m[:, 0], run.motion.position_m[:, 2]
    axes.set_title("Path from above [m]", pad=_HEADING_PT)
    axes.plot(x_m, z_m, color=colour, linewidth=1.1)
    axes.plot(x_m[0], z_m[0], "o", color=style.TEXT, markersize=4)
    axes.annotate("start", (x_m[0], z_m[0]), xytext=(5, 0), textcoords="offset points", va="center", color=colour)
    arrow_row = int(np.searchsorted(run.motion.t_s, _ARROW_S))
    arrow = {"arrowstyle": "-|>", "color": colour, "linewidth": 1.1, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (x_m[arrow_row + 40], z_m[arrow_row + 40]), (x_m[arrow_row], z_m[arrow_row]), arrowprops=arrow)
    axes.set_aspect("equal", adjustable="datalim")
    axes.invert_yaxis()
    axes.margins(0.18)
    axes.set_xlabel("x", loc="right", labelpad=1)
    axes.set_ylabel("z", loc="bottom", labelpad=1, rotation=0)
    axes.xaxis.set_major_locator(MaxNLocator(3))
    axes.yaxis.set_major_locator(MaxNLocator(4))
