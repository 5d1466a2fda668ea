"""The candidates to compare: from the most to the least expensive, and from the most accurate to the cheapest."""

import numpy as np

from study_app.evidence.accuracy.candidates import (
    InterpretedRung,
    LinearRung,
    ListRung,
    Rung,
    TickRung,
    UnsteadyRung,
    given,
)
from study_app.evidence.accuracy.naive_wake import NumpyTail, PlainTail
from study_app.evidence.scene_variants import _only, with_effects, with_wake
from study_app.haptics.model.effects.drag import REFERENCE
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.laws.drag_laws import Law
from study_app.haptics.model.scene import Effect, Estimator, Ewma, Foaw, Given, Line, Raw, Scene

SLOWER = (2, 4, 10)
RESOLUTIONS_M = (0.005, 0.02)
LEAST_RATE_HZ = 50.0
_WORDS: dict[Effect, str] = {"added_mass": "added mass", "history": "history"}
_SHORT: dict[Law, str] = {
    "constant": "constant C$_d$",
    "schiller-naumann": "Schiller–Naumann (SN)",
    "haider-levenspiel": "Haider–Levenspiel (HL)",
    "brown-lawler": "Brown–Lawler (BL)",
}
_PLAIN: dict[Law, str] = {
    "constant": "constant C_d",
    "schiller-naumann": "Schiller–Naumann",
    "haider-levenspiel": "Haider–Levenspiel",
    "brown-lawler": "Brown–Lawler",
}
_INITIALS: dict[Law, str] = {
    "constant": _SHORT["constant"],
    "schiller-naumann": "SN",
    "haider-levenspiel": "HL",
    "brown-lawler": "BL",
}


def drag_and_wake(scene: Scene) -> Scene:
    """Return the scene's first liquid everywhere, with only its law of drag and its wake, if selected."""
    liquid = resolve(scene).liquids[0]
    effects = ("drag", "wake") if "wake" in liquid.effects else ("drag",)
    return _only(scene, liquid.model_copy(update={"effects": effects}))


def numerical(scene: Scene) -> tuple[tuple[Rung, ...], Rung]:
    """Return implementations of one definition, or of parts of it; and the one used in the program.

    ``scene`` is of one liquid, by `drag_and_wake`. What is about the wake is left out where there is none.
    """
    exact = given(scene)
    name = "O(1) wake" if _has_wake(scene) else "drag"
    program = TickRung(name, name, "tick", exact)
    rungs: list[Rung] = [program]
    if _has_wake(scene):
        rungs += _lists(exact)
    for every in SLOWER:
        if scene.rate_hz / every >= LEAST_RATE_HZ:
            slower = exact.model_copy(update={"rate_hz": scene.rate_hz / every})
            hertz = f"{slower.rate_hz:g} Hz"
            rungs.append(TickRung(f"{program.name}, {hertz}", hertz, "rate", slower, every=every))
    for estimator in _estimators(scene):
        name = f"{program.name}, velocity by {estimator.kind} from encoder counts"
        noisy = scene.model_copy(update={"velocity": estimator})
        rungs.append(TickRung(name, f"velocity: {estimator.kind}", "estimator", noisy, counted=True))
    return tuple(rungs), program


def _lists(exact: Scene) -> list[Rung]:
    """Return alternatives to the wake: lists, shorter or coarser ones, none."""
    length = exact.liquids[0].wake.length
    half, quarter = max(1, length // 2), max(1, length // 4)
    rungs: list[Rung] = [
        ListRung("O(N) compiled", "O(N) compiled", "list", exact),
        ListRung("O(N) compiled, float32", "O(N) float32", "list", exact, precision=np.float32),
        InterpretedRung("O(N) numpy", "numpy", "list", exact, tail=NumpyTail),
        InterpretedRung("O(N) plain Python", "Python", "list", exact, tail=PlainTail),
        ListRung("O(N) compiled, tail N/2", "O(N), N/2", "list", with_wake(exact, length=half)),
        ListRung("O(N) compiled, tail N/4", "O(N), N/4", "list", with_wake(exact, length=quarter)),
        TickRung("O(1) wake, tail N/4", "tail N/4", "tick", with_wake(exact, length=quarter)),
    ]
    for step_m in RESOLUTIONS_M:
        step = f"{1e3 * step_m:g} mm"
        coarse = with_wake(exact, resolution_m=step_m)
        rungs.append(TickRung(f"O(1) wake, resolution {step}", f"resolution {step}", "tick", coarse))
    rungs.append(TickRung("drag alone", "drag alone", "tick", with_effects(exact, "drag")))
    return rungs


def _estimators(scene: Scene) -> tuple[Estimator, ...]:
    """Return one of each kind, the scene's own unchanged."""
    own = scene.velocity
    kinds: tuple[Estimator, ...] = (Ewma(), Line(), Foaw(), Raw())
    return tuple(own if not isinstance(own, Given) and own.kind == it.kind else it for it in kinds)


def physical(scene: Scene) -> tuple[tuple[Rung, ...], Rung]:
    """Return models of a liquid with a viscosity, in order of accuracy; and the one that the gate would choose."""
    exact = given(_only(scene, scene.liquids[0]))
    rungs: list[Rung] = [LinearRung("linear viscosity", "linear viscosity", "law", exact)]
    rungs += [
        TickRung(_PLAIN[law], label, "law", with_effects(exact, "drag", law=law)) for law, label in _SHORT.items()
    ]
    carried: tuple[Effect, ...] = ()
    for effect in ("added_mass", "history"):
        carried = (*carried, effect)
        rungs.append(_carrying(exact, REFERENCE, carried))
    rungs.append(UnsteadyRung("unsteady drag", "unsteady drag", "effects", with_effects(exact, "unsteady_drag")))
    gated = resolve(_only(scene, scene.liquids[0].model_copy(update={"effects": "auto"}))).liquids[0]
    carried = tuple(it for it in _WORDS if it in gated.effects)
    if "unsteady_drag" in gated.effects:
        return tuple(rungs), rungs[-1]
    if "drag" not in gated.effects:
        choice: Rung = TickRung("no resistance", "no resistance", "effects", with_effects(exact, *carried))
    else:
        choice = _carrying(exact, gated.drag.law, carried)
    same = next((rung for rung in rungs if type(rung) is TickRung and rung.scene == choice.scene), None)
    return (tuple(rungs), same) if same is not None else ((*rungs, choice), choice)


def _carrying(exact: Scene, law: Law, carried: tuple[Effect, ...]) -> Rung:
    """Return drag with added mass and history as applicable."""
    words = [_WORDS[it] for it in carried]
    of = with_effects(exact, "drag", *carried, law=law)
    return TickRung(" + ".join([_PLAIN[law], *words]), " + ".join([_INITIALS[law], *words]), "effects", of)


def _has_wake(scene: Scene) -> bool:
    return "wake" in scene.liquids[0].effects
