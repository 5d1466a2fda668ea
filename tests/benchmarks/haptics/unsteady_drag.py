"""What a tick of unsteady drag takes beside one of drag, added mass and history, batch about batch.

Run it by itself: ``python tests/benchmarks/haptics/unsteady_drag.py``.
"""

import statistics

from study_app.evidence.cost import TickTimer
from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.scene import Liquid, Scene

MODELS = {"no effect": (), "apart": ("drag", "added_mass", "history"), "unsteady drag": ("unsteady_drag",)}
GLYCERIN = Liquid(id="glycerin", density_kg_m3=1261, viscosity_pa_s=1.41, drag=Drag(law="haider-levenspiel"))


def costs_ns(batches: int) -> tuple[float, float]:
    """Return the extra cost of a tick with each effect and with unsteady drag [ns], medians of batches."""
    liquids = {name: GLYCERIN.model_copy(update={"effects": effects}) for name, effects in MODELS.items()}
    benches = {name: TickTimer(Scene(scale=3, liquids=(liquid,))) for name, liquid in liquids.items()}
    for _ in range(batches):
        for bench in benches.values():
            bench.run_batch()
    rest_ns, apart_ns, law_ns = (statistics.median(bench.costs_ns) for bench in benches.values())
    return apart_ns - rest_ns, law_ns - rest_ns


def main() -> None:
    """Print nanoseconds a tick of each beyond a tick without effects, and their ratio."""
    apart_ns, law_ns = costs_ns(300)
    print(f"drag, added mass and history {apart_ns:.0f} ns, unsteady drag {law_ns:.0f} ns a tick")
    print(f"ratio {law_ns / apart_ns:.2f}")


if __name__ == "__main__":
    main()
