"""Studies for the oracle: their sessions are simulated, and every measured column has drawn values, all different."""

import csv
from pathlib import Path

import numpy as np

from study_app.store.columns import DELIVERED, INTERVALS, TRIALS_2

NOT_DRAWN = frozenset("part of targets setting standard level video_frames video_frames_late video_frames_lost".split())
MEASURED = {one.name: one.kind for one in (*INTERVALS, *TRIALS_2, *DELIVERED) if one.name not in NOT_DRAWN}
SPREAD = 0.05
"""Standard deviation of the logarithm of what is delivered of a number."""


def draw_measurements(study: Path, seed: int = 1) -> None:
    """Draw what was not measured in trials and intervals; delivered numbers are near the requested ones."""
    draw = np.random.default_rng(seed)
    for path in sorted((study / "data").rglob("*_data.csv")):
        if not path.name.endswith(("trials_data.csv", "intervals_data.csv")):
            continue
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        for row in rows:
            drawn = {
                name: _drawn(MEASURED[name], draw) for name, cell in row.items() if cell == "n/a" and name in MEASURED
            }
            if "value_delivered" in row:
                drawn["value_delivered"] = repr(_requested(row) * float(np.exp(SPREAD * draw.normal())))
            row.update({name: value for name, value in drawn.items() if value is not None})
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)


def _drawn(kind: str, draw: np.random.Generator) -> str | None:
    if kind == "flag":
        return "true" if draw.random() < 0.8 else "false"
    if kind == "integer":
        return str(draw.integers(1, 10**9))
    return repr(float(draw.uniform(0.01, 0.99))) if kind == "number" else None


def _requested(row: dict[str, str]) -> float:
    """Return the number that an interval was to present."""
    if row["standard"] == "n/a":
        return float(row["level"])
    return float(row["standard"]) * (1 + float(row["level"]) * (row["presented"] == "comparison"))
