"""Motions of a hand in the scene frame, and what a sensor in a planted liquid measures along them."""

from pathlib import Path
from typing import Any

import numpy as np

from study_app.haptics.model.scene import Scene
from study_app.haptics.runtime.offline import ModelAlong
from study_app.lab.estimation.estimator import Estimate, OnlineEstimator
from study_app.lab.estimation.fits import with_wake
from study_app.lab.estimation.sources import Rows
from study_app.protocol.load import load_scene

WATER = load_scene("rek2024", "water")
NOISE_N = 0.03
BATCH = 33
COLUMNS = "t_s,x_m,y_m,z_m,fx_n,fy_n,fz_n"


def planted(scene: Scene = WATER, drag: float = 0.42, length: int = 1200, scaling: float = 1500.0) -> Scene:
    """Return a scene with other values of what is estimated."""
    body = scene.body.model_copy(update={"drag_coefficient": drag})
    return with_wake(scene.model_copy(update={"body": body}), length, scaling)


def stirring(seconds: float = 10.0, rate_hz: float = 1000.0) -> tuple[Any, Any]:
    """Return times (n,) and places (n, 3) of a hand that stirs: strokes of ±25 mm that swell, across ±10 mm."""
    t_s = np.arange(round(seconds * rate_hz)) / rate_hz
    turn = 2 * np.pi * t_s
    x = 0.25 * np.sin(0.37 * turn) * (1 + 0.3 * np.sin(0.13 * turn))
    return t_s, np.column_stack([x, 0 * t_s, 0.1 * np.sin(0.53 * turn)])


def wandering(draw: Any) -> tuple[Any, Any]:
    """Return times (n,) and places (n, 3) of a hand of three sines of random periods, sizes and phases."""
    t_s = np.arange(round(1000 * draw.uniform(3, 15))) / 1000
    size = np.exp(draw.uniform(np.log(0.01), np.log(0.3)))
    places = np.zeros((len(t_s), 3))
    for _ in range(3):
        turn = 2 * np.pi * (draw.uniform(0.05, 1.0) * t_s + draw.random())
        places += size * draw.standard_normal(3) * [0.6, 0.1, 0.4] * np.sin(turn)[:, np.newaxis]
    return t_s, places


def measured(scene: Scene, t_s: Any, position_m: Any, *, noise_n: float = NOISE_N, seed: int = 1) -> Rows:
    """Return what a sensor measures along a motion in a liquid, its velocities known."""
    velocity_mps = np.gradient(position_m, t_s, axis=0)
    scene = scene.model_copy(update={"rate_hz": round(1 / (t_s[1] - t_s[0]))})
    force_n = np.array(ModelAlong(scene, given=True).follow(t_s, position_m, velocity_mps).force_n)
    force_n += noise_n * np.random.default_rng(seed).standard_normal(force_n.shape)
    return Rows(
        t_s=t_s, position_m=position_m, velocity_mps=velocity_mps, force_n=force_n, usable=np.ones(len(t_s), bool)
    )


def fed(estimator: OnlineEstimator, rows: Rows, batch: int = BATCH) -> Estimate:
    """Return the estimate after rows that came in batches."""
    for first in range(0, len(rows), batch):
        estimator.take(rows.part(first, first + batch))
    return estimator.estimate


def lines(rows: Rows, *, velocities: bool = True) -> list[str]:
    columns = [rows.t_s[:, np.newaxis], rows.position_m, rows.force_n, *([rows.velocity_mps] if velocities else [])]
    return [",".join(f"{it:.17g}" for it in row) + "\n" for row in np.hstack(columns)]


def begun(path: Path, text: str = f"# made by a robot\n{COLUMNS},vx_mps,vy_mps,vz_mps\n") -> Path:
    path.write_text(text, encoding="utf-8")
    return path
