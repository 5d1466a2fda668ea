"""Fits of models to the fluid solver's force on the ball, and the solver against published drag: tables and a figure.

Every model is fitted to every motion by ``identify.fit``. The fitted parameters are then tested on the same liquid at
the other speed, because the parameters of a liquid must not depend on the motion of the hand.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from study_app import figure_style as style
from study_app.evidence.cfd import score
from study_app.evidence.cfd.solved_cases import RAMP, STOP, Case
from study_app.evidence.cfd.stored_flows import Table as SolvedTable
from study_app.evidence.reference_solutions import PERCEPTIBLE_N, RELATIVE, measured_drag_n
from study_app.evidence.table import Evidence, Table, plot_files
from study_app.haptics.model.device_dynamics import MOST_DELAY, Dynamics
from study_app.haptics.model.effects import LocalWake, Wake
from study_app.haptics.model.laws import LAWS
from study_app.haptics.model.motion import Floats, Motion
from study_app.haptics.model.overrides import override_all
from study_app.haptics.model.scene import Effect, Ewma, Given, Liquid, Scene
from study_app.haptics.runtime.offline import ModelAlong, simulate
from study_app.lab.identify.fit import fit
from study_app.lab.identify.measured_force import along_a_line
from study_app.lab.identify.parameters import find_parameters

_RATE_HZ: Final = 1000.0
_LAW: Final = "brown-lawler"


@dataclass(frozen=True, slots=True)
class Model:
    """A drag law with other effects, and the names of the parameters that are fitted."""

    name: str
    effects: tuple[Effect, ...]
    law: str = _LAW
    free: tuple[str, ...] = ()


MODELS: Final = (
    Model("drag, constant C_d", ("drag",), "constant", ("drag_coefficient",)),
    Model("constant C_d, wake", ("drag", "wake"), "constant", ("drag_coefficient", "length", "scaling", "exponent")),
    Model("Reynolds-dependent drag", ("drag",)),
    Model("... and wake", ("drag", "wake"), free=("length", "scaling", "exponent")),
    Model("... and local wake", ("drag", "local_wake"), free=("length", "scaling", "exponent", "spreading_m2ps")),
    Model("... and added mass", ("drag", "added_mass")),
    Model("... added mass, wake", ("drag", "wake", "added_mass"), free=("length", "scaling", "exponent")),
    Model("... and history", ("drag", "history")),
    Model("... history, added mass", ("drag", "added_mass", "history")),
    Model("... history, added mass fitted", ("drag", "added_mass", "history"), free=("coefficient",)),
    Model("unsteady drag", ("unsteady_drag",)),
)
"""From the thesis' drag alone to all forces of creeping flow, and the law whose constants are fitted to the solver. The
"..." in a name stands for the Reynolds-dependent drag."""

_START: Final = {"length": 300, "scaling": 1000.0}


@dataclass(frozen=True, eq=False, kw_only=True)
class Fitted:
    """One model fitted to one motion at the scene's rate: its parameters, and its error against the solver.

    ``force_n`` (n,) is the force along the motion, ``rms_n`` and ``worst_n`` the RMS and the greatest error, ``share``
    the RMS error relative to the RMS force, and ``within`` the fraction of time in which the accuracy target is met.
    ``push`` is the momentum that the liquid gives the ball after the stop, relative to the solver's: 0 for none,
    negative against the previous motion. ``carried`` is ``share`` at the liquid's other speed with the same parameters.
    ``warnings`` are those of the fit.
    """

    model: Model
    case: Case
    values: dict[str, float]
    force_n: Floats
    rms_n: float
    worst_n: float
    share: float
    within: float
    push: float
    carried: float
    warnings: tuple[str, ...] = ()


def fit_all(tables: Sequence[SolvedTable], progress: Callable[[str], None] = lambda _: None) -> tuple[Fitted, ...]:
    """Return every model fitted to every table, and tested on the other tables of the same liquid."""
    fits = []
    for table in tables:
        progress(f"fitting {len(MODELS)} models to {table.case.liquid_id}, {table.notes['title']} ...")
        others = [it for it in tables if it.case.liquid_id == table.case.liquid_id and it is not table]
        for model in MODELS:
            values, warnings = fit_one(model, table)
            fits.append(evaluate_fit(model, table, values, others, warnings))
    return tuple(fits)


def fit_one(model: Model, table: SolvedTable) -> tuple[dict[str, float], tuple[str, ...]]:
    """Return the best-fitting parameters of the model for the table, and the warnings of the fit."""
    if not model.free:
        return {}, ()
    motion, force_n = resampled(table)
    fit_result = fit(_scene_of(model, table.case), table.case.liquid_id, model.free, motion, force_n)
    return {
        parameter.name: fit_result.values[parameter.name] for parameter in fit_result.parameters
    }, fit_result.warnings


def evaluate_fit(
    model: Model,
    table: SolvedTable,
    values: Mapping[str, float],
    others: Sequence[SolvedTable] = (),
    warnings: tuple[str, ...] = (),
) -> Fitted:
    """Return the errors of a model with these parameters for the table and for others of the same liquid."""
    motion, solved_n = resampled(table)
    force_n = _force_along(model, table.case, values, motion)
    error_n = np.abs(force_n - solved_n)
    carried = [
        _relative_error(_force_along(model, other_table.case, values, other_motion) - true_n, true_n)
        for other_table in others
        for other_motion, true_n in (resampled(other_table),)
    ]
    after = motion.t_s > (STOP + RAMP) * table.case.unit_s
    return Fitted(
        model=model,
        case=table.case,
        values=dict(values),
        force_n=force_n,
        rms_n=_rms(error_n),
        worst_n=float(error_n.max()),
        share=_relative_error(error_n, solved_n),
        within=float(np.mean(error_n <= np.maximum(RELATIVE * np.abs(solved_n), PERCEPTIBLE_N))),
        push=float(force_n[after].sum() / solved_n[after].sum()),
        carried=max(carried, default=math.nan),
        warnings=warnings,
    )


def _scene_of(model: Model, case: Case, values: Mapping[str, float] | None = None) -> Scene:
    """Return a scene with the model's effects in the liquid of the case, at 1 kHz with known velocities."""
    tables: dict[str, Any] = {}
    if "wake" in model.effects:
        tables["wake"] = Wake(**_START)
    if "local_wake" in model.effects:
        tables["local_wake"] = LocalWake(reach_m=case.diameter_m, **_START)
    liquid = Liquid(
        id=case.liquid_id,
        density_kg_m3=case.density_kg_m3,
        viscosity_pa_s=case.viscosity_pa_s,
        effects=model.effects,
        drag={"law": model.law},
        **tables,
    )
    scene = Scene(
        scale=1.0, rate_hz=_RATE_HZ, body={"diameter_m": case.diameter_m}, liquids=(liquid,), velocity=Given()
    )
    return override_all(scene, dict(values or {}))


def _force_along(model: Model, case: Case, values: Mapping[str, float], motion: Motion) -> Floats:
    """Return the model's force (n,) [N] for a motion along x."""
    force_n: Floats = np.array(simulate(_scene_of(model, case, values), motion).fx_n)
    return force_n


def resampled(table: SolvedTable) -> tuple[Motion, Floats]:
    """Return a table's motion and force (n,), resampled to one row per tick so that all times have equal weight."""
    t_s, velocity_mps, force_n = table.columns.values()
    times_s = np.arange(math.floor(t_s[-1] * _RATE_HZ) + 1) / _RATE_HZ
    even_n = np.interp(times_s, t_s, force_n)
    return along_a_line(times_s, np.interp(times_s, t_s, velocity_mps), even_n).motion, even_n


def _relative_error(error_n: Floats, force_n: Floats) -> float:
    return _rms(error_n) / _rms(force_n)


def _rms(values: Floats) -> float:
    return math.sqrt(float(np.mean(values**2)))


_SCORED_MODELS: Final[Mapping[str, tuple[int, Mapping[str, float]]]] = {
    "thesis: drag and wake": (1, {"length": 1700, "scaling": 1700.0, "exponent": 0.75}),  # of water, rek2024
    "drag, added mass, history": (8, {}),
    "unsteady drag": (10, {}),
}
"""The models that the benchmark `score` scores, by name: their indices in `MODELS`, and parameters."""
_REPEATS: Final = 10
"""Number of times that all models follow each motion in turn; the shortest time counts, which other programs delay
least."""


class Tick:
    """A model that computes the force along x, tick by tick or, with `along`, for a known motion.

    With ``sent``, velocities are estimated and the force passes the safety layer; otherwise velocities are exact.
    """

    def __init__(self, name: str, setup: Mapping[str, float], *, sent: bool) -> None:
        place, values = _SCORED_MODELS[name]
        case = Case(
            liquid_id="liquid",
            density_kg_m3=setup["density_kg_m3"],
            viscosity_pa_s=setup["viscosity_pa_s"],
            diameter_m=setup["diameter_m"],
            speed_mps=0.0,
        )
        scene = _scene_of(MODELS[place], case, values)
        dynamics = None
        if sent:
            scene = scene.model_copy(update={"velocity": Ewma()})
            delay_s = min(setup["delay_ticks"], MOST_DELAY) / _RATE_HZ
            dynamics = Dynamics(delay_s=delay_s, mass_kg=min(setup["handle_kg"], max(score.HANDLES_KG)))
        self._sent = sent
        self._model = ModelAlong(scene, dynamics, given=not sent)

    def __call__(self, t_s: float, x_m: float, v_mps: float) -> float:
        return float(self.along(np.array([t_s]), np.array([x_m]), np.array([v_mps]))[0])

    def along(self, t_s: Floats, x_m: Floats, v_mps: Floats) -> Floats:
        """Return the forces along x (n,) [N] at times [s], positions [m] and velocities [m/s], each (n,)."""
        position_m, velocity_mps = np.zeros((2, len(t_s), 3))
        position_m[:, 0], velocity_mps[:, 0] = x_m, v_mps
        samples = self._model.follow(t_s, position_m, None if self._sent else velocity_mps)
        force_n: Floats = (samples.device_force_n if self._sent else samples.force_n)[:, 0]
        return force_n


def score_all(progress: Callable[[str], object] = lambda _line: None) -> Evidence:
    """Score every model of `_SCORED_MODELS`, the law alone and as sent.

    All models follow each motion in turn, so that their times are comparable.
    """
    solved_motions = score.motions()
    engines = {
        f"{name}, as sent" if sent else name: partial(Tick, name, sent=sent)
        for name in _SCORED_MODELS
        for sent in (False, True)
    }
    scores: dict[str, list[score.Score]] = {title: [] for title in engines}
    for motion in solved_motions:
        progress(f"{motion.name} ...")
        rounds = [[score.score(engine, motion) for engine in engines.values()] for _ in range(_REPEATS)]
        for title, engine_scores in zip(engines, zip(*rounds, strict=True), strict=True):
            scores[title].append(min(engine_scores, key=lambda engine_score: engine_score.tick_ns))
    rows, first = [], next(iter(scores.values()))
    for title, engine in engines.items():
        progress(f"{title}: released handles ...")
        rows.append(score.row(title, scores[title], score.all_releases(engine, solved_motions), first))
    table = Table(score.HEADINGS, rows, left=1)
    text = table.markdown() + "\n"
    return Evidence(text, {"score.md": text, "score.csv": table.csv()})


_WIDTH_PT: Final = 85 / 25.4 * 72
_PANEL_PT: Final = 118.0
_LOOKS: Final[dict[str, tuple[str, dict[str, Any]]]] = {
    "Reynolds-dependent drag": ("drag alone", {"color": "#5d6a75", "linestyle": (0, (1, 1.2))}),
    "constant C_d, wake": ("constant $C_d$ and wake", {"color": "#b35600", "linestyle": (0, (5, 2))}),
    "... history, added mass": ("drag, history, added mass", {"color": "#0b65a3", "linestyle": "-"}),
}
_SOLVER: Final[dict[str, Any]] = {"color": "#13202c", "linewidth": 3.2, "alpha": 0.35}
_AFTER: Final = 8.0


@style.own_settings(style.PLOT_SETTINGS)
def draw(tables: Sequence[SolvedTable], fits: Sequence[Fitted]) -> Figure:
    """Draw the force for the fastest motion through each liquid, from its start to 8 D/U after its stop."""
    shown = {table.case.liquid_id: table for table in sorted(tables, key=lambda it: it.case.speed_mps)}
    height_pt = _PANEL_PT * len(shown) + 30
    figure = Figure(figsize=(_WIDTH_PT / 72, height_pt / 72), facecolor="white")
    axes = figure.subplots(len(shown), 1, squeeze=False)[:, 0]
    figure.subplots_adjust(left=0.12, right=0.98, top=1 - 44 / height_pt, bottom=28 / height_pt, hspace=0.42)
    for ax, table in zip(axes, shown.values(), strict=True):
        _draw_panel(ax, table, [it for it in fits if it.case == table.case and it.model.name in _LOOKS])
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper left", ncols=2, frameon=False, fontsize=6.8, bbox_to_anchor=(0.0, 1.0))
    axes[-1].set_xlabel("time [s]")
    return figure


def _draw_panel(ax: Axes, table: SolvedTable, fits: Sequence[Fitted]) -> None:
    case, (motion, force_n) = table.case, resampled(table)
    t_s = motion.t_s
    shown = t_s <= (STOP + _AFTER) * case.unit_s
    ax.plot(t_s[shown], force_n[shown], label="fluid solver", **_SOLVER)
    order = [it.name for it in MODELS]
    for it in sorted(fits, key=lambda it: order.index(it.model.name)):
        label, line_style = _LOOKS[it.model.name]
        ax.plot(t_s[shown], it.force_n[shown], label=label, linewidth=1.1, **line_style)
    even_n = float(np.interp(STOP * case.unit_s * 0.95, t_s, force_n))
    ax.set_ylim(2.3 * even_n, -1.6 * even_n)
    ax.axhline(0, color=style.ZERO, linewidth=0.6)
    ax.set_title(f"{case.liquid_id}, {case.speed_mps:g} m/s, Re {case.reynolds:.2g}: force along the motion [N]")
    ax.yaxis.set_major_locator(MaxNLocator(5))
    _annotate(ax, "stop", (STOP * case.unit_s, 0), (-21, 5))
    for peak, edge in ((int(force_n.argmin()), 0), (int(force_n.argmax()), 1)):
        _annotate(ax, f"to {force_n[peak]:.1f} N", (t_s[peak], ax.get_ylim()[edge]), (9, -7 if edge else 3))


def _annotate(ax: Axes, text: str, point: tuple[float, float], offset_pt: tuple[float, float]) -> None:
    text = text.replace("-", "−")
    ax.annotate(text, point, offset_pt, textcoords="offset points", fontsize=6.6, color=style.TEXT_SOFT)


FITS_FILE: Final = "fits.csv"
COLUMNS: Final = (
    "table", "model", "parameters", "rms_n", "worst_n", "share", "within", "push", "carried",
)  # fmt: skip
MITTAL: Final = {50.0: 1.57, 100.0: 1.09}
"""C_d of a sphere by a spectral method: Mittal 1999, Int. J. Numer. Meth. Fluids 30:921, as quoted in the validation of
Notus CFD, https://doc.notus-cfd.org ("steady flows past a sphere")."""
_CONSTANT: Final = 0.47
_EDGE: Final = 1e-6


def clift(reynolds: float) -> float:
    """Return C_d of a sphere by Clift, Grace & Weber 1978, Bubbles, Drops and Particles, table 5.12, Re 0.01 to 260."""
    if reynolds <= 20:
        return 24 / reynolds * (1 + 0.1315 * math.pow(reynolds, 0.82 - 0.05 * math.log10(reynolds)))
    return 24 / reynolds * (1 + 0.1935 * math.pow(reynolds, 0.6305))


def _steady_markdown(table: SolvedTable) -> str:
    """Return a Markdown table of steady drag: the solver's C_d and the deviations of the others from it."""
    names = ["coarser grid", "half the box", "Clift et al. 1978", "Mittal 1999", "experiments", *LAWS, "C_d 0.47"]
    rows = []
    for reynolds, solved, coarse, narrow in zip(*(it.tolist() for it in table.columns.values()), strict=True):
        others = [coarse, narrow, clift(reynolds), MITTAL.get(reynolds), _measured_drag_coefficient(reynolds)]
        others += [law(reynolds) * 24 / reynolds for law in LAWS.values()]
        proportions = ["" if it is None else _format_signed(it / solved - 1) for it in (*others, _CONSTANT)]
        rows.append((f"{reynolds:g}", f"{solved:.4g}", *proportions))
    return Table(("Re", "C_d, solver", *names), rows).markdown()


def _fits_markdown(fits: Sequence[Fitted]) -> str:
    """Return the fits as Markdown, one table per motion."""
    parts = []
    for case in dict.fromkeys(fitted.case for fitted in fits):
        parts.append(f"{case.liquid_id}, {case.speed_mps:g} m/s (Re {case.reynolds:.3g})")
        parts.append(Table(_HEADINGS, [_fit_row(fitted) for fitted in fits if fitted.case == case], left=2).markdown())
    return "\n\n".join([*parts, "\\* at the edge of the permitted range: the best value may lie outside it."])


def fits_csv(fits: Sequence[Fitted]) -> str:
    """Return the fits as CSV with the columns `COLUMNS`; parameters are ``name=value`` pairs separated by blanks."""
    rows = []
    for fitted in fits:
        numbers = (fitted.rms_n, fitted.worst_n, fitted.share, fitted.within, fitted.push, fitted.carried)
        parameters = " ".join(f"{name}={value!r}" for name, value in fitted.values.items())
        rows.append([fitted.case.name, fitted.model.name, parameters, *(f"{number:.6g}" for number in numbers)])
    return Table(COLUMNS, rows).csv()


def fits_evidence(tables: Sequence[SolvedTable], drag: SolvedTable, fits: Sequence[Fitted]) -> Evidence:
    """Return the fits as CSV, both tables as Markdown, and the figure."""
    text = f"{_steady_markdown(drag)}\n\n{_fits_markdown(fits)}\n"
    files = {FITS_FILE: fits_csv(fits), "cfd.md": text}
    return Evidence(text, files, plot_files("cfd", "Models against a fluid solver", draw, tables, fits))


_HEADINGS: Final = (
    "model", "fitted", "RMS error", "greatest error", "within target", "push after the stop", "other speed",
)  # fmt: skip


def _fit_row(it: Fitted) -> tuple[str, ...]:
    ranges = find_parameters(_scene_of(it.model, it.case), it.case.liquid_id, it.model.free) if it.model.free else ()
    within = {
        parameter.name
        for parameter in ranges
        if parameter.least * (1 + _EDGE) < it.values[parameter.name] < parameter.most * (1 - _EDGE)
    }
    fitted = ", ".join(f"{name} {value:.3g}{'' if name in within else '*'}" for name, value in it.values.items())
    return (
        *(it.model.name, fitted or "nothing", f"{it.rms_n:.2g} N ({it.share:.1%})", f"{it.worst_n:.2g} N"),
        *(f"{it.within:.0%}", _format_signed(it.push, 0), f"{it.carried:.1%}"),
    )


def _measured_drag_coefficient(reynolds: float) -> float:
    """Return the measured C_d that `truths` interpolates, for a sphere and a liquid of unit size and density."""
    speed_mps = np.array([1.0])
    liquid = Liquid(id="any", density_kg_m3=1.0, viscosity_pa_s=1 / reynolds)
    return float(measured_drag_n(liquid, 1.0, speed_mps)[0]) / (math.pi / 8)


def _format_signed(share: float, digits: int = 1) -> str:
    return f"{share:+.{digits}%}".replace("-", "−")
