"""How different two colours look, to normal and to colour-blind eyes: slow and by the book, for the tests alone.

CIEDE2000: Sharma, Wu & Dalal (2005), Color Res. Appl. 30, 21-30. Eyes: Machado, Oliveira & Fernandes (2009), IEEE
Trans. Vis. Comput. Graph. 15, 1291-1298, full severity, applied to linear light.
"""

from itertools import pairwise
from math import atan2, cos, degrees, exp, hypot, radians, sin, sqrt
from typing import TypeAlias

import numpy as np
from matplotlib.colors import to_rgb

Lab: TypeAlias = tuple[float, float, float]

EYES = {
    "normal": np.eye(3),
    "protan": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deutan": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritan": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}

SRGB_TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
WHITE = SRGB_TO_XYZ.sum(axis=1)
"""D65, as sRGB's own white."""


def lab(colour: str, eye: str) -> Lab:
    """Return CIELAB of a colour ("#6d1007") as an ``eye`` sees it."""
    encoded = np.array(to_rgb(colour))
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    xyz = SRGB_TO_XYZ @ np.clip(EYES[eye] @ linear, 0, 1) / WHITE
    f = np.where(xyz > (6 / 29) ** 3, np.cbrt(xyz), xyz / (3 * (6 / 29) ** 2) + 4 / 29)
    return float(116 * f[1] - 16), float(500 * (f[0] - f[1])), float(200 * (f[1] - f[2]))


def ciede2000(one: Lab, other: Lab) -> float:
    """Return the CIEDE2000 difference of two colours in CIELAB."""
    mean_chroma = (hypot(*one[1:]) + hypot(*other[1:])) / 2
    stretch = 1 + 0.5 * (1 - sqrt(mean_chroma**7 / (mean_chroma**7 + 25**7)))
    (l1, c1, h1), (l2, c2, h2) = (_polar(lab_, stretch) for lab_ in (one, other))
    turn = 0.0 if c1 * c2 == 0 else (h2 - h1 + 180) % 360 - 180
    hue = h1 + h2 if c1 * c2 == 0 else (h1 + turn / 2) % 360
    light, chroma = (l1 + l2) / 2, (c1 + c2) / 2
    t = 1 - 0.17 * cos(radians(hue - 30)) + 0.24 * cos(radians(2 * hue))
    t += 0.32 * cos(radians(3 * hue + 6)) - 0.20 * cos(radians(4 * hue - 63))
    rotation = -sin(radians(60 * exp(-(((hue - 275) / 25) ** 2)))) * 2 * sqrt(chroma**7 / (chroma**7 + 25**7))
    by_light = (l2 - l1) / (1 + 0.015 * (light - 50) ** 2 / sqrt(20 + (light - 50) ** 2))
    by_chroma = (c2 - c1) / (1 + 0.045 * chroma)
    by_hue = 2 * sqrt(c1 * c2) * sin(radians(turn / 2)) / (1 + 0.015 * chroma * t)
    return sqrt(by_light**2 + by_chroma**2 + by_hue**2 + rotation * by_chroma * by_hue)


def _polar(colour: Lab, stretch: float) -> tuple[float, float, float]:
    """Return lightness, chroma and hue [degrees], with a* stretched."""
    light, a, b = colour
    return light, hypot(stretch * a, b), degrees(atan2(b, stretch * a)) % 360


def smallest(palette: tuple[str, ...], eye: str) -> tuple[float, float]:
    """Return the smallest difference of neighbouring levels, and of a level and its mirror image (1 and 7, ...)."""
    lab_colours = [lab(colour, eye) for colour in palette]
    neighbours = [ciede2000(a, b) for a, b in pairwise(lab_colours)]
    mirrored = [ciede2000(lab_colours[place], lab_colours[-1 - place]) for place in range(len(lab_colours) // 2)]
    return min(neighbours), min(mirrored)
