"""Solved flows as CSV files with ``# name: value`` comment lines on their provenance; reading needs no solver."""

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import resources
from importlib.resources.abc import Traversable
from typing import Final

import numpy as np

from study_app.errors import StudyError
from study_app.evidence.cfd.solved_cases import PROFILES, STOPPING
from study_app.evidence.cfd.solved_cases import Case as SolvedCase
from study_app.evidence.reference_model import Constants
from study_app.evidence.reference_solutions import Case, Truth, along_x
from study_app.haptics.model.motion import Floats
from study_app.haptics.model.scene import Scene
from study_app.lab.identify.measured_force import vectors_x
from study_app.store.files import csv_text_of

MOTION: Final = ("t_s", "velocity_mps", "force_n")
"""Columns of a motion along one axis; the force is that on the ball, at first against the motion."""
STEADY: Final = ("reynolds", "drag_coefficient", "drag_coefficient_coarse", "drag_coefficient_narrow")
"""Columns of steady drag: C_d, C_d on a coarser grid, and C_d in a box of half the size."""
STEADY_FILE: Final = "steady.csv"
TRAINING_FOLDER: Final = "training"
HELD_OUT_FOLDER: Final = "held_out"
LEFT_OUT: Final = ("motion", *Constants._fields)
"""The constants of unsteady drag that are fitted to all motions but one, for each motion."""
LEFT_OUT_FILE: Final = "left_out.csv"
_MODEL_NOTES: Final = ("density_kg_m3", "viscosity_pa_s", "diameter_m", "computing_s_per_s")
"""The numeric notes of a `MOTION` table that a comparison with models needs."""
_CASE_NOTES: Final = ("density_kg_m3", "viscosity_pa_s", "diameter_m", "speed_mps")


@dataclass(frozen=True, eq=False)
class Table:
    """One file: its notes and its named columns, each (n,)."""

    notes: dict[str, str]
    columns: dict[str, Floats]

    @property
    def case(self) -> SolvedCase:
        """The solved case that the notes of a `MOTION` table describe."""
        profile = PROFILES[self.notes.get("profile", STOPPING.name)]
        density_kg_m3, viscosity_pa_s, diameter_m, speed_mps = (float(self.notes[name]) for name in _CASE_NOTES)
        return SolvedCase(
            liquid_id=self.notes["liquid"],
            density_kg_m3=density_kg_m3,
            viscosity_pa_s=viscosity_pa_s,
            diameter_m=diameter_m,
            speed_mps=speed_mps,
            profile=profile,
        )


def file_bytes(notes: Mapping[str, str], columns: Mapping[str, Sequence[float] | Floats]) -> bytes:
    """Return a table as file content."""
    head = "".join(f"# {name}: {value}\n" for name, value in notes.items())
    rows = ([f"{value:.7g}" for value in row] for row in zip(*columns.values(), strict=True))
    return (head + csv_text_of([columns, *rows])).encode()


def notes_of(case: SolvedCase) -> dict[str, str]:
    """Return the notes that describe a solved case."""
    values = (case.density_kg_m3, case.viscosity_pa_s, case.diameter_m, case.speed_mps)
    return {
        "liquid": case.liquid_id,
        "profile": case.profile.name,
        **{name: f"{value:.6g}" for name, value in zip(_CASE_NOTES, values, strict=True)},
    }


def load_tables(folder: Traversable | None = None, subfolder: str = "") -> tuple[Table, ...]:
    """Return the `MOTION` tables of the package or of a folder, or of its ``subfolder``, sorted by liquid and speed.

    Raises
    ------
    StudyError
        There is no such table, or one cannot be parsed.
    """
    folder_ = folder or package()
    folder_ = folder_ / subfolder if subfolder else folder_
    names = folder_.iterdir() if folder_.is_dir() else ()
    files = sorted((file for file in names if file.name.endswith("mmps.csv")), key=lambda file: file.name)
    if not files:
        raise StudyError(
            f"{folder_} does not contain the fluid solver's tables: create them with liquid-study cfd --solve"
        )
    return tuple(read_table(file, MOTION, _MODEL_NOTES) for file in files)


training: Final = partial(load_tables, subfolder=TRAINING_FOLDER)
"""Motions that constants are fitted to in addition to those of `load_tables`."""
held_out: Final = partial(load_tables, subfolder=HELD_OUT_FOLDER)
"""Motions that no fit uses."""


def _load_left_out(folder: Traversable | None = None) -> dict[str, Constants]:
    """Return the constants of unsteady drag that were fitted without one motion, by case name; may be empty."""
    file = (folder or package()) / LEFT_OUT_FILE
    if not file.is_file():
        return {}
    try:
        header, *rows = csv.reader(file.read_text(encoding="utf-8").splitlines())
        if tuple(header) != LEFT_OUT:
            raise ValueError(f"its columns are {','.join(header)}, not {','.join(LEFT_OUT)}")  # noqa: TRY301
        return {name: Constants._make(map(float, values)) for name, *values in rows}
    except (OSError, ValueError, TypeError) as error:
        raise StudyError(
            f"{file.name} cannot be used ({error}): recreate it with liquid-study cfd --refit --to DIR"
        ) from error


def load_steady(folder: Traversable | None = None) -> Table:
    """Return the table of `STEADY`; it raises the errors of `read_table`."""
    return read_table((folder or package()) / STEADY_FILE, STEADY)


def package() -> Traversable:
    """Return the folder of the stored tables."""
    return resources.files("study_app.evidence.cfd")


def read_table(file: Traversable, names: Sequence[str], numeric_notes: Sequence[str] = ()) -> Table:
    """Return a table with these columns, whose notes ``numeric_notes`` are numbers.

    Raises
    ------
    StudyError
        The file does not exist, or cannot be parsed.
    """
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
        pairs = (line[1:].split(":", 1) for line in lines if line.startswith("#"))
        notes = {name.strip(): value.strip() for name, value in pairs}
        for name in numeric_notes:
            float(notes.get(name, f"the note {name} is missing"))
        header, *rows = csv.reader(line for line in lines if not line.startswith("#"))
        if tuple(header) != tuple(names):
            raise ValueError(f"its columns are {','.join(header)}, not {','.join(names)}")  # noqa: TRY301
        numbers = np.array([[float(field) for field in row] for row in rows]).T
        columns = dict(zip(names, numbers, strict=True))
    except (OSError, ValueError) as error:
        raise StudyError(
            f"the solver's table {file.name} cannot be used ({error}): recreate it with liquid-study cfd --solve"
        ) from error
    return Table(notes, columns)


def solver_truths(scene: Scene, folder: Traversable | None = None) -> tuple[Truth, ...]:
    """Return the fluid solver's results for the scene's liquid and body at the scene's rate, if any."""
    liquid = scene.liquids[0]
    scene_properties = (liquid.density_kg_m3, liquid.viscosity_pa_s or math.nan, scene.body.diameter_m)
    further_tables = (*training(), *held_out()) if folder is None else ()
    tables = (*load_tables(folder), *further_tables)
    left_out = _load_left_out() if folder is None else {}
    truths = []
    for table in tables:
        notes = table.notes
        *table_properties, computing_s = (float(notes[name]) for name in _MODEL_NOTES)
        if not np.allclose(table_properties, scene_properties, rtol=0.01, atol=0):
            continue
        t_s, velocity_mps, force_n = table.columns.values()
        times_s = np.arange(t_s[0], t_s[-1], 1 / scene.rate_hz)
        speeds_mps = np.interp(times_s, t_s, velocity_mps)
        distance_m = np.concatenate([[0.0], np.cumsum((speeds_mps[1:] + speeds_mps[:-1]) / 2 * np.diff(times_s))])
        case = Case(
            along_x(times_s - times_s[0], distance_m, speeds_mps),
            vectors_x(np.interp(times_s, t_s, force_n)),
            np.ones(len(times_s), bool),
        )
        source = f"fluid solver: {notes.get('command', 'unknown command')}"
        title = notes.get("title", "a solved flow")
        constants = left_out.get(table.case.name) if left_out else None
        truths.append(
            Truth(
                name=title,
                source=source,
                cases=(case,),
                computing_s=computing_s,
                machine=notes.get("machine", ""),
                left_out=constants,
            )
        )
    return tuple(truths)
