"""Accuracy of the force of each liquid, its range of speed, the time per tick, and differences between drag laws."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from study_app.evidence import reference_solutions as truths
from study_app.evidence.accuracy import candidates
from study_app.evidence.cfd.stored_flows import held_out, load_tables, solver_truths, training
from study_app.evidence.expected_error import Expected, expected
from study_app.evidence.reference_solutions import error_of, measured_drag_n
from study_app.evidence.table import Evidence, Table
from study_app.haptics.model.laws import LAWS, finite_reynolds
from study_app.haptics.model.scene import Liquid, Scene

_MAX_REFERENCE_REYNOLDS: Final = 1000.0
"""Greatest Reynolds number with a solution or measurement of an unsteady motion in this program."""
FILE: Final = "liquids.md"
_REYNOLDS: Final = (1.0, 10.0, 100.0, 200.0, 1e3, 3e3, 1e4, 3e4, 1e5)


def _clift_gauvin(reynolds: float) -> float:
    """Return C_d Re/24 of a sphere by Clift & Gauvin 1971, Re ≤ 3·10⁵."""
    return 1 + 0.15 * math.pow(reynolds, 0.687) + 0.42 / 24 * reynolds / (1 + 42500 * math.pow(reynolds, -1.16))


def _turton_levenspiel(reynolds: float) -> float:
    """Return C_d Re/24 of a sphere by Turton & Levenspiel 1986, Powder Technology 47, Re ≤ 2·10⁵."""
    high = 0.413 / 24 * reynolds / (1 + 16300 * math.pow(reynolds, -1.09))
    return 1 + 0.173 * math.pow(reynolds, 0.657) + high


def _cheng(reynolds: float) -> float:
    """Return C_d Re/24 of a sphere by Cheng 2009, Powder Technology 189, Re ≤ 2·10⁵."""
    high = 0.47 / 24 * reynolds * (1 - math.exp(-0.04 * math.pow(reynolds, 0.38)))
    return math.pow(1 + 0.27 * reynolds, 0.43) + high


PUBLISHED: Final[Mapping[str, Callable[[float], float]]] = {
    "Schiller–Naumann 1933": LAWS["schiller-naumann"],
    "Clift–Gauvin 1971": _clift_gauvin,
    "Turton–Levenspiel 1986": _turton_levenspiel,
    "Haider–Levenspiel 1989": LAWS["haider-levenspiel"],
    "Brown–Lawler 2003": LAWS["brown-lawler"],
    "Cheng 2009": _cheng,
}


@dataclass(frozen=True, kw_only=True)
class Surveyed:
    """One liquid: its Reynolds number at the scene's greatest speed, its model, and the model's errors.

    Errors are relative RMS errors with known velocities, against creeping flow, experiments and the fluid solver. They
    are None without such a reference, or if the ball is too fast for creeping flow. ``solver_reynolds`` is the range of
    the solved motions.
    """

    liquid: str
    speed_mps: float
    mps_per_reynolds: float
    model: str
    creeping: float | None
    steady: float | None
    solver: float | None
    solver_reynolds: tuple[float, float]
    expected: Expected

    @property
    def reynolds(self) -> float:
        """Reynolds number at the scene's greatest speed."""
        return self.speed_mps / self.mps_per_reynolds


def survey_scenes(
    scenes: Mapping[str, Scene], progress: Callable[[str], None] = lambda _: None
) -> tuple[Surveyed, ...]:
    """Measure every liquid of a file that has a viscosity, most viscous first."""
    surveyed = []
    for name, scene in scenes.items():
        liquid = scene.liquids[0]
        if liquid.viscosity_pa_s is None or liquid.drag.law == "linear":
            continue
        progress(name)
        surveyed.append(_survey_liquid(name, scene, liquid, liquid.viscosity_pa_s))
    return tuple(sorted(surveyed, key=lambda liquid: liquid.reynolds))


def _survey_liquid(name: str, scene: Scene, liquid: Liquid, viscosity_pa_s: float) -> Surveyed:
    models, model = candidates.physical_candidates(scene)
    scene_ = models[0].scene

    def relative_error(truth: truths.Truth) -> float:
        return error_of(model.forces_against(truth), truth).rms

    steady, solved = truths.steady_truth(scene_), solver_truths(scene_)
    mps_per_reynolds = viscosity_pa_s / (liquid.density_kg_m3 * scene.body.diameter_m)
    motions = [case.motion for truth in solved for case in truth.cases]
    speeds = [float(np.abs(truth.velocity_mps).max()) for truth in motions if truth.velocity_mps is not None]
    speed_mps = scene.motion_in(liquid).speed_mps or math.nan
    creeping = max(relative_error(truths.oscillation_truth(scene_)), relative_error(truths.starting_truth(scene_)))
    return Surveyed(
        liquid=name,
        speed_mps=speed_mps,
        mps_per_reynolds=mps_per_reynolds,
        model=model.name,
        creeping=creeping if speed_mps <= _MAX_REFERENCE_REYNOLDS * mps_per_reynolds else None,
        steady=None if steady is None else relative_error(steady),
        solver=max(map(relative_error, solved)) if solved else None,
        solver_reynolds=(min(speeds) / mps_per_reynolds, max(speeds) / mps_per_reynolds)
        if solved
        else (math.nan, math.nan),
        expected=expected(scene),
    )


def _relative_law_spread(reynolds: float) -> float:
    """Return the greatest difference between published laws of steady drag, relative to their mean."""
    ratios = [law(reynolds) for law in PUBLISHED.values()]
    return (max(ratios) - min(ratios)) * len(ratios) / sum(ratios)


def survey_evidence(found: tuple[Surveyed, ...]) -> Evidence:
    """Return tables of the liquids and of drag laws as a function of the Reynolds number, as Markdown."""
    highest = max(it.case.reynolds for it in (*load_tables(), *training(), *held_out()))
    liquids = []
    for it in found:
        minimum, greatest = it.solver_reynolds
        checked_mps = min(it.speed_mps, highest * it.mps_per_reynolds)
        cells = (
            it.liquid,
            f"{float(f'{it.reynolds:.3g}'):,g} ({it.speed_mps:g} m/s)",
            it.model,
            _format_percent(it.creeping),
            _format_percent(it.steady),
            _format_percent(it.solver) + (f" (Re {_format_range(minimum, greatest)})" if it.solver is not None else ""),
            f"{checked_mps:.2g} m/s" if it.model == "unsteady drag" else "–",
            _format_percent(_relative_law_spread(it.reynolds)),
            _format_percent(it.expected.causes.law),
            _format_percent(it.expected.error_share),
            f"{it.expected.cost_ns:.0f}",
        )
        liquids.append(cells)
    laws = []
    for reynolds in _REYNOLDS:
        drags = [law(reynolds) for law in (*PUBLISHED.values(), finite_reynolds)]
        values = [f"{24 / reynolds * ratio:.3g}" for ratio in (*drags, _measured_drag_ratio(reynolds))]
        laws.append((f"{reynolds:,g}", *values, _format_percent(_relative_law_spread(reynolds))))
    tables = (
        Table(_HEADINGS, liquids, left=(0, 2)),
        Table(("Re", *PUBLISHED, "unsteady drag", "experiments", "spread"), laws),
    )
    text = f"{tables[0].markdown()}\n\n{_WHAT.format(highest)}\n\n{tables[1].markdown()}\n"
    return Evidence(text, {FILE: text})


_HEADINGS: Final = (
    "liquid", "highest Re (speed)", "model", "creeping flow", "steady drag", "fluid solver", "solved up to",
    "drag laws differ by", "strokes, known velocity", "strokes, estimated velocity", "ns per tick",
)  # fmt: skip
_WHAT: Final = (
    "Errors are RMS errors divided by the RMS force, with known velocities. Each is the largest over several "
    "references: creeping flow at Re 0.01, experiments on steady drag, and a fluid solver at 1 kHz. Unsteady drag "
    "predicts each motion with constants fitted to the other motions. Motions have been solved up to Re {:.3g}, or "
    f"up to the scene's highest speed. Above Re {_MAX_REFERENCE_REYNOLDS:g} there is no reference for unsteady motion, "
    "and the uncertainty of steady drag is the difference between the published laws. Strokes are compared with the "
    "laws at the scene's highest speed and acceleration, with known velocities, and with velocities that the scene's "
    "estimator derives from encoder counts, after the force limits. The second table lists the drag coefficients of "
    "each law."
)


def _measured_drag_ratio(reynolds: float) -> float:
    """Return C_d Re/24 as measured in experiments."""
    liquid = Liquid(id="any", density_kg_m3=1.0, viscosity_pa_s=1.0)
    return float(measured_drag_n(liquid, 1.0, np.array([reynolds]))[0]) / (3 * math.pi * reynolds)


def _format_range(least: float, greatest: float) -> str:
    return " to ".join(dict.fromkeys(f"{value:.2g}" if value < 10 else f"{value:.0f}" for value in (least, greatest)))


def _format_percent(share: float | None) -> str:
    if share is None:
        return "–"
    return f"{100 * share:.0f} %" if share >= 0.1 else f"{100 * share:.2g} %"
