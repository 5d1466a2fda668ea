"""Non-Newtonian liquids that tests share: the presets of protocols/slime.toml."""

from study_app.haptics.model.scene import Liquid, Scene
from study_app.protocol.load import load

PRESETS = {
    name: (liquid.density_kg_m3, liquid.non_newtonian)
    for name, liquid in load("slime").liquids.items()
    if liquid.non_newtonian is not None
}


def tank(name, *, scale=1.0, effects=("non_newtonian",), table=None, **fields):
    """Return a scene of one preset, by default with its drag alone, perhaps with another flow curve."""
    density_kg_m3, preset = PRESETS[name]
    one = Liquid(id=name, density_kg_m3=density_kg_m3, effects=effects, non_newtonian=table or preset)
    return Scene(liquids=(one,), scale=scale, format=2, **fields)
