"""Solved flows as CSV files, with comment lines ``# name: value`` on what made them; read without the solver."""

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
"""Along one axis; the force on the ball, so against the motion at first."""
STEADY: Final = ("reynolds", "drag_coefficient", "drag_coefficient_coarse", "drag_coefficient_narrow")
"""C_d, the same on a coarser grid, and in a box of half the size."""
STEADY_FILE: Final = "steady.csv"
TRAINING_FOLDER: Final = "training"
HELD_OUT_FOLDER: Final = "held_out"
LEFT_OUT: Final = ("motion", *Constants._fields)
"""The constants of unsteady drag that are fitted to all motions but one, for each motion."""
LEFT_OUT_FILE: Final = "left_out.csv"
_OF_THE_MODEL: Final = ("density_kg_m3", "viscosity_pa_s", "diameter_m", "computing_s_per_s")
"""The notes of a table of `MOTION` by which models are compared with it."""
_OF_THE_CASE: Final = ("density_kg_m3", "viscosity_pa_s", "diameter_m", "speed_mps")


@dataclass(frozen=True, eq=False)
class Table:
    """One file: its notes and its named columns, each (n,)."""

    notes: dict[str, str]
    columns: dict[str, Floats]

    @property
    def case(self) -> SolvedCase:
        """The solved case that the notes of a `MOTION` table describe."""
        profile = PROFILES[self.notes.get("profile", STOPPING.name)]
        density_kg_m3, viscosity_pa_s, diameter_m, speed_mps = (float(self.notes[name]) for name in _OF_THE_CASE)
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
        **{name: f"{value:.6g}" for name, value in zip(_OF_THE_CASE, values, strict=True)},
    }


def load_tables(folder: Traversable | None = None, of: str = "") -> tuple[Table, ...]:
    """Return the `MOTION` tables of the package or of a folder, or those in its subfolder ``of``, by liquid and speed.

    Raises
    ------
    StudyError
        There is no such table, or one cannot be parsed.
    """
    place = folder or package()
    place = place / of if of else place
    names = place.iterdir() if place.is_dir() else ()
    files = sorted((it for it in names if it.name.endswith("mmps.csv")), key=lambda it: it.name)
    if not files:
        raise StudyError(
            f"{place} does not contain the fluid solver's tables: create them with liquid-study cfd --solve"
        )
    return tuple(read_table(it, MOTION, _OF_THE_MODEL) for it in files)


training: Final = partial(load_tables, of=TRAINING_FOLDER)
"""Motions that constants are fitted to in addition to those of `load_tables`."""
held_out: Final = partial(load_tables, of=HELD_OUT_FOLDER)
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


def read_table(file: Traversable, names: Sequence[str], noted: Sequence[str] = ()) -> Table:
    """Return a table with these columns, whose notes ``noted`` are numbers.

    Raises
    ------
    StudyError
        The file does not exist, or cannot be parsed.
    """
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
        said = (line[1:].split(":", 1) for line in lines if line.startswith("#"))
        notes = {name.strip(): value.strip() for name, value in said}
        for name in noted:
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
    ours = (liquid.density_kg_m3, liquid.viscosity_pa_s or math.nan, scene.body.diameter_m)
    more = (*training(), *held_out()) if folder is None else ()
    tables = (*load_tables(folder), *more)
    without = _load_left_out() if folder is None else {}
    truths = []
    for table in tables:
        notes = table.notes
        *of, computing_s = (float(notes[name]) for name in _OF_THE_MODEL)
        if not np.allclose(of, ours, rtol=0.01, atol=0):
            continue
        t_s, velocity_mps, force_n = table.columns.values()
        even_s = np.arange(t_s[0], t_s[-1], 1 / scene.rate_hz)
        even_mps = np.interp(even_s, t_s, velocity_mps)
        way_m = np.concatenate([[0.0], np.cumsum((even_mps[1:] + even_mps[:-1]) / 2 * np.diff(even_s))])
        case = Case(
            along_x(even_s - even_s[0], way_m, even_mps),
            vectors_x(np.interp(even_s, t_s, force_n)),
            np.ones(len(even_s), bool),
        )
        source = f"fluid solver: {notes.get('command', 'unknown command')}"
        title = notes.get("title", "a solved flow")
        constants = without.get(table.case.name) if without else None
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
