"""Warnings about delayed forces that the passivity controller withholds in part.

The withheld proportions are in ``delayed_force.csv`` in this folder; ``evidence.stability.force_delay`` measured them
with the servo's own tick.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from functools import cache
from importlib import resources
from itertools import takewhile
from operator import attrgetter
from typing import Final, NamedTuple

import numpy as np

from study_app.haptics.model.slope_limits import steady_force
from study_app.protocol.checks.consistency import felt_numbers
from study_app.protocol.checks.force_limits import LIMIT_J, damping_nspm, returned_j
from study_app.protocol.checks.force_limits import longest_delay_ms as longest_returned_ms
from study_app.protocol.load import load
from study_app.protocol.model import Follow, Protocol
from study_app.protocol.trials.tasks import Stroke

WITHHELD_PERCENT: Final = 5.0
"""If more of the force is withheld, a trial does not present the requested force."""


class Entry(NamedTuple):
    """A row of the table: a liquid of ``rek2024``, or of ``physical2`` as "physical2_water", with one grip.

    The grip in ``hand`` is "light", "middle" or "firm"; the force is delayed by ``delay_ms`` in addition to the
    device's delay. ``left_percent`` is the RMS of the force sent relative to that of the requested force,
    ``withheld_percent`` the proportion of the force that is withheld, as in a trial.
    """

    liquid: str
    estimator: str
    hand: str
    delay_ms: float
    left_percent: float
    withheld_percent: float


@cache
def stored_table() -> tuple[Entry, ...]:
    """Return the rows of the shipped table."""
    with (resources.files("study_app.protocol.warnings") / "delayed_force.csv").open(encoding="utf-8") as file:
        return tuple(
            Entry(
                liquid=row["liquid"],
                estimator=row["estimator"],
                hand=row["hand"],
                delay_ms=float(row["delay_ms"]),
                left_percent=float(row["left_percent"]),
                withheld_percent=float(row["withheld_percent"]),
            )
            for row in csv.DictReader(file)
        )


def longest_delay_ms(
    liquid: str, estimator: str, hand: str = "light", withheld_percent: float = WITHHELD_PERCENT
) -> float:
    """Return the longest delay [ms] at which at most ``withheld_percent`` of the force is withheld; -1 if none."""
    rows = _table_rows(liquid, estimator, hand)
    if not rows:
        raise KeyError((liquid, estimator, hand))
    permitted = takewhile(lambda row: row.withheld_percent <= withheld_percent, rows)
    return max((row.delay_ms for row in permitted), default=-1.0)


def _table_rows(liquid: str, estimator: str, hand: str) -> list[Entry]:
    """Return the table's rows for a liquid, the shortest delay first."""
    rows = (row for row in stored_table() if (row.liquid, row.estimator, row.hand) == (liquid, estimator, hand))
    return sorted(rows, key=attrgetter("delay_ms"))


STIRRED: Final = Stroke(frequency_hz=1.061, amplitude_m=0.03)
"""The motion for which the table was measured: ±30 mm with at most 0.2 m/s."""
_STUDIES_IN_TABLE: Final = (("rek2024", ""), ("physical2", "physical2_"))
"""The studies whose liquids are in the table, and the prefix of their names there."""
_load: Final = cache(load)


def delay_warnings(protocol: Protocol) -> Iterator[str]:
    """Yield warnings about conditions whose delayed force is withheld in part."""
    presented = {name for block in protocol.blocks.values() for name in protocol.conditions_in(block.id)}
    for name, condition in protocol.conditions.items():
        delay_ms = 1000 * condition.link().mean_delay_s(protocol.device.rate_hz)
        if name not in presented or delay_ms == 0 or len(condition.liquid_ids) > 1:
            continue
        table_name = _name_in_table(protocol, condition.liquid_ids[0])
        problem = (
            _energy_warning(protocol, name, delay_ms)
            if table_name is None
            else _table_warning(protocol, name, table_name, delay_ms)
        )
        if problem is not None:
            yield f"conditions.{name}.force_delay_ms: {problem}, or delay the picture instead"


def _table_warning(protocol: Protocol, name: str, liquid: str, delay_ms: float) -> str | None:
    """Return a warning for a liquid of the table and a light grip; None if little is withheld."""
    estimator = protocol.scene.velocity.kind if protocol.scene.velocity.kind == "kalman" else "ewma"
    longest_ms = longest_delay_ms(liquid, estimator)
    if delay_ms <= longest_ms:
        return None
    rows = _table_rows(liquid, estimator, "light")
    percent = float(np.interp(delay_ms, [row.delay_ms for row in rows], [row.withheld_percent for row in rows]))
    if percent <= WITHHELD_PERCENT:
        return None
    force_n = steady_force(protocol.scene_for(name), STIRRED.speed_mps).drag_n
    return (
        f"with a delay of {delay_ms:.3g} ms and a light grip, the passivity controller holds back about "
        f"{percent:.0f} % of the force ({percent / 100 * force_n:.2g} of {force_n:.2g} N at {STIRRED.speed_mps:.2g} "
        "m/s): choose at most "
        f"{longest_ms:g} ms"
    )


def _energy_warning(protocol: Protocol, name: str, delay_ms: float) -> str | None:
    """Return a warning if a liquid outside the table returns too much energy in the motion of its tasks."""
    scene, workspace_m = protocol.scene_for(name), protocol.device.workspace_m
    tasks = [
        protocol.tasks[block.task] for block in protocol.blocks.values() if name in protocol.conditions_in(block.id)
    ]
    strokes = [task.fastest_stroke(workspace_m) if isinstance(task, Follow) else STIRRED for task in tasks]
    energy_j, stroke = max(
        (returned_j(damping_nspm(scene, stroke), stroke, delay_ms / 1000), stroke) for stroke in strokes
    )
    if energy_j <= LIMIT_J:
        return None
    damping = damping_nspm(scene, stroke)
    return (
        f"with a delay of {delay_ms:.3g} ms, a force of {damping * stroke.speed_mps:.2g} N at "
        f"{stroke.speed_mps:.2g} m/s returns {1000 * energy_j:.1f} mJ per motion reversal, and the passivity "
        f"controller holds back part of the force: choose at most {longest_returned_ms(damping, stroke)} ms"
    )


def _name_in_table(protocol: Protocol, liquid: str) -> str | None:
    """Return the name in the table of a liquid with the same numbers and scale, or None."""
    for study, prefix in _STUDIES_IN_TABLE:
        shipped = _load(study)
        if shipped.scene.scale != protocol.scene.scale:
            continue
        for name, shipped_liquid in shipped.liquids.items():
            is_listed = any(entry.liquid == prefix + name for entry in stored_table())
            if is_listed and felt_numbers(shipped_liquid) == felt_numbers(protocol.liquids[liquid]):
                return prefix + name
    return None
