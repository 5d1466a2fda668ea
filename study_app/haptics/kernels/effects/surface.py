"""Surface: the submerged fraction of the ball, for the effects that depend on it.

With the depth h of the ball's lowest point, 0 … 2R, and u = 1 − h/R: the spherical cap has the volume πh²(3R − h)/3;
the frontal area of vertical motion is the waterplane π(2Rh − h²) until half the ball is submerged, then πR²; that of
horizontal motion is the circular segment R²(arccos u − u√(1 − u²)). All are continuous at the surface, and the volume
has a continuous slope.
"""

from __future__ import annotations

import math

from study_app.haptics.kernels.compiled import part
from study_app.haptics.model.layout import Record


@part
def submerge(liquid: Record, local: Record, place_m: Record, radius_m: float) -> None:
    """Set the fractions of volume and frontal areas, 0 … 1, that are below the top face of the region."""
    surface, region = local.surface, liquid.region
    depth = (region.centre_m[1] + region.half_m[1] - place_m[1]) / radius_m + 1.0  # h/R
    if depth <= 0.0:
        surface.volume = surface.upright = surface.level = 0.0
    elif depth >= 2.0:
        surface.volume = surface.upright = surface.level = 1.0
    else:
        u = 1.0 - depth
        surface.volume = 0.25 * depth * depth * (3.0 - depth)
        surface.upright = 1.0 if u < 0.0 else 1.0 - u * u
        surface.level = (math.acos(u) - u * math.sqrt(1.0 - u * u)) / math.pi


@part
def wetted_fraction(local: Record) -> None:
    """Set the fraction φ of the frontal area for the motion w: vertical and horizontal parts weighted by w's squares.

    Exact for vertical and horizontal motion; a weighted mean for other directions. [choice]
    """
    w, surface = local.relative_mps, local.surface
    level = w[0] * w[0] + w[2] * w[2]
    upright = w[1] * w[1]
    if level + upright > 0.0:
        share = (level * surface.level + upright * surface.upright) / (level + upright)
    else:
        share = surface.level
    local.frontal = local.border * share
