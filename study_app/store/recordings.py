"""The files of a trial's recording: every sample of the servo, and every frame that was shown, as Parquet.

Times, positions and velocities measured by the device are stored exactly, so that the trial can be recomputed; computed
velocities and forces are rounded to steps far below the resolution of device and hand, so that half an hour at 1 kHz
takes 30 to 56 MB; a measured velocity adds 43 MB at most. A CRC-32 of the exact computed numbers of every second proves
them.

Positions, velocities and forces are in the frames of ``haptics.model.layout.SAMPLE``. Any Parquet reader can read the
columns, with unit and meaning in each column's metadata.
"""

import hashlib
import json
import os
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
from numpy.typing import NDArray
from pyarrow import parquet

from study_app.errors import StoreError
from study_app.haptics.model.device_dynamics import ASSUMED_TICKS
from study_app.haptics.model.layout import (
    FORCE_STEP_N,
    MEASURED_GRIPPER,
    MEASURED_ORIENTATION,
    MEASURED_VELOCITY,
    SAMPLE,
    records,
)
from study_app.store.atomic import cannot_read, parse_json, sync_folder, temporary_path
from study_app.store.journals.journal_events import plain
from study_app.store.tables.csv_files import Column

_AXES = (("x", "to the right"), ("y", "up"), ("z", "toward the participant"))
FRAMES: tuple[Column, ...] = (
    Column("painted_ns", "integer", "Time when the frame was shown, on the servo's clock.", "ns"),
    Column("sample_ns", "integer", "Time of the hand position that was shown.", "ns"),
    Column("age_ns", "integer", "Achieved visual delay: painted_ns - sample_ns.", "ns"),
    Column("video_frame", "integer", "Number of the video's frame in it, from 0; -1 without one.", minimum=-1),
    Column(
        "video_ns",
        "integer",
        "Time when that was due without a delay, on the servo's clock: when the camera's picture was ready, or by the "
        "time in the file; 0 without one.",
        "ns",
    ),
    Column(
        "video_age_ns",
        "integer",
        "Age of the camera's picture when it was ready, by the source's time stamps: it was taken at video_ns - "
        "video_age_ns; -1 if unknown or without one.",
        "ns",
        minimum=-1,
    ),
)
FORMAT = 4
SPEED_STEP_MPS = 2.0**-12
ROUNDED_TO = {
    "velocity_mps": SPEED_STEP_MPS,
    "wake_mps": SPEED_STEP_MPS,
    "device_force_n": FORCE_STEP_N,
    "command_n": FORCE_STEP_N,
    "force_n": FORCE_STEP_N,
}
"""Fields of ``layout.SAMPLE`` that are recorded rounded, and the step."""
FRAME = np.dtype([(column.name, np.int64) for column in FRAMES])
NO_VIDEO = {"video_frame": -1, "video_ns": 0, "video_age_ns": -1}
"""Values of a frame without a video."""
FACTS_KEY = b"liquid_study"
AXES = ("x", "y", "z")
MEASURED = {
    **{f"device_velocity_{axis}_mps": ("device_velocity_mps", i, MEASURED_VELOCITY) for i, axis in enumerate(AXES)},
    **{f"orientation_{part}": ("orientation", i, MEASURED_ORIENTATION) for i, part in enumerate("wxyz")},
    "gripper_m": ("gripper_m", None, MEASURED_GRIPPER),
}
"""Optional measurements of a device: field of ``layout.SAMPLE``, its component, and its bit."""
_SINCE_2 = frozenset({"delay_ticks", *(f"undelivered_{axis}_n" for axis in AXES)})
_SINCE_3 = frozenset({"measured", "device_time_ns", *MEASURED})
_LACKING = {1: _SINCE_2 | _SINCE_3 | NO_VIDEO.keys(), 2: _SINCE_3 | NO_VIDEO.keys(), 3: NO_VIDEO.keys(), FORMAT: ()}
"""Columns that recordings of each format lack."""
SHORT = frozenset({"buttons", "delay_ticks", "limiters", "measured", "scene", "status"})
GROUP_SECONDS = 30  # rows of so many seconds are compressed together
_COMPRESSION = ("zstd", 9)


def _vector(name: str, unit: str, ending: str, description: str) -> tuple[Column, ...]:
    return tuple(
        Column(f"{name}_{axis}_{ending}", "number", f"{description}, {direction}.", unit) for axis, direction in _AXES
    )


SAMPLES: tuple[Column, ...] = (
    Column("tick", "integer", "Number of the servo's tick since its start; gaps are lost samples."),
    Column("time_ns", "integer", "Time when the device was read, on the servo's clock.", "ns"),
    Column("due_ns", "integer", "Time when the tick was due; its lateness is time_ns - due_ns.", "ns"),
    Column("fresh", "flag", "true where the device reported a new sample."),
    *_vector("position", "m", "m", "Position of the hand, exact"),
    *_vector(
        "velocity", "m/s", "mps", ("Velocity in the scene from which the force was computed; resolution 1/4096 m/s")
    ),
    *_vector("wake", "m/s", "mps", "Velocity of the liquid's wake in the scene; resolution 1/4096 m/s"),
    *_vector("device_force", "N", "n", "Force that the device applied to the hand; resolution 1/16384 N"),
    *_vector("undelivered", "N", "n", "Force that the servo commanded and the device did not apply"),
    *_vector(
        "withheld",
        "N",
        "n",
        ("Force of the liquid that was withheld: the force of the liquid is device_force + withheld"),
    ),
    Column("buttons", "integer", "Pressed buttons of the device, as bits."),
    Column("limiters", "integer", "Limiters that acted, as bits in the order of the trial's limiter columns."),
    Column("delay_ticks", "integer", "Estimated delay of the force, in ticks.", minimum=0, maximum=4),
    Column("scene", "integer", "Number of the presented scene; 0 is none.", minimum=0),
    Column(
        "status",
        "integer",
        "State of the servo.",
        levels=(
            ("0", "running normally"),
            ("1", "no usable sample for 50 ms"),
            ("2", "device lost"),
            ("3", "a non-finite force (NaN or infinite)"),
        ),
    ),
    Column(
        "measured",
        "integer",
        "What the device measured itself, as bits: 1 velocity, 2 orientation, 4 gripper, 8 time.",
        minimum=0,
        maximum=15,
    ),
    *_vector("device_velocity", "m/s", "mps", "Velocity of the hand, as the device measured it (NaN if not measured)"),
    *(
        Column(
            f"orientation_{part}",
            "number",
            f"Orientation of the handle in the hand frame: {part} of a unit quaternion; NaN if not measured.",
        )
        for part in "wxyz"
    ),
    Column("gripper_m", "number", "Opening of the gripper; NaN if not measured.", "m"),
    Column("device_time_ns", "integer", "Time of the sample on the device's clock; 0 if not measured.", "ns"),
)


@dataclass(frozen=True, slots=True)
class Written:
    """A file that is complete on the disk."""

    path: Path
    rows: int
    sha256: str


@dataclass(frozen=True, slots=True)
class Checks:
    """CRC-32 of the float64 forces (little-endian, x y z a row): of every ``rows`` rows, and of the rest at the end."""

    rows: int
    device_force: tuple[int, ...]
    effect_force: tuple[int, ...]


def read_samples(path: Path) -> Any:
    """Return the samples (n,) as a recarray of ``SAMPLE``; ``busy_ns``, which is not recorded, is 0.

    The first sample's force on the hand, from which the next one moves, is exact. Recordings of format 1 assume that
    every device sends the commanded force one tick late; until format 2 no device measured its velocity.

    Raises
    ------
    StoreError
        It cannot be read, or is not a recording of samples.
    """
    columns, facts = _read(path, "samples")
    samples = records(SAMPLE, len(columns["tick"]))
    for name in ("tick", "time_ns", "fresh", "buttons", "limiters", "scene", "status"):
        samples[name] = columns[name]
    samples["delay_ticks"] = columns.get("delay_ticks", ASSUMED_TICKS)
    samples["lateness_ns"] = columns["time_ns"] - columns["due_ns"]
    for i, axis in enumerate(AXES):
        samples["position_m"][:, i] = columns[f"position_{axis}_m"]
        samples["velocity_mps"][:, i] = columns[f"velocity_{axis}_mps"]
        samples["wake_mps"][:, i] = columns[f"wake_{axis}_mps"]
        device = columns[f"device_force_{axis}_n"].astype(np.float64)
        samples["device_force_n"][:, i] = device
        samples["command_n"][:, i] = device + columns.get(f"undelivered_{axis}_n", 0.0)
        samples["force_n"][:, i] = device + columns[f"withheld_{axis}_n"]
    if "measured" in columns and len(samples):
        samples["measured"], samples["device_time_ns"] = columns["measured"], columns["device_time_ns"]
        for name, (field, component, bit) in MEASURED.items():
            values = np.where(columns["measured"] & bit, columns[name], 0.0)
            samples[field][... if component is None else (..., component)] = values
    if len(samples) and None not in facts["first_device_force_n"]:
        samples["device_force_n"][0] = facts["first_device_force_n"]
        samples["command_n"][0] = facts.get("first_command_n", facts["first_device_force_n"])
    return samples


def read_frames(path: Path) -> Any:
    """Return the frames (n,) as a recarray of `FRAME`: when painted, of which moment, and what of a video [ns].

    Raises
    ------
    StoreError
        It cannot be read, or is not a recording of frames.
    """
    columns, _ = _read(path, "frames")
    frames = records(FRAME, len(columns["painted_ns"]))
    for name in FRAME.names or ():
        frames[name] = columns.get(name, NO_VIDEO.get(name, 0))
    return frames


def read_facts(path: Path) -> dict[str, Any]:
    """Return the file's metadata, without reading its rows: facts, ``kind``, ``rows``."""
    try:
        metadata = parquet.read_metadata(path)
    except OSError as error:
        raise cannot_read(path, error) from error
    except (pa.ArrowException, UnicodeDecodeError) as error:
        raise _damaged(path, error) from error
    return _facts(path, metadata)


def read_checks(path: Path) -> Checks:
    """Return the CRCs of a recording of samples.

    Raises
    ------
    StoreError
        It cannot be read, or has none.
    """
    facts = read_facts(path)
    if facts["kind"] != "samples":
        raise StoreError(f"{path} holds {facts['kind']}, not samples: name the recording itself")
    checks = facts["crc32"]
    return Checks(checks["rows"], tuple(checks["device_force"]), tuple(checks["effect_force"]))


def crcs(forces: NDArray[np.float64], rows: int) -> list[int]:
    """Return the CRC-32 of every ``rows`` forces (n, 3) [N], and of those left at the end."""
    exact = np.ascontiguousarray(forces, "<f8")
    return [zlib.crc32(exact[first : first + rows].tobytes()) for first in range(0, len(exact), rows)]


def column_type(column: Column) -> pa.DataType:
    """Return how a column is stored."""
    if column.kind == "flag":
        return pa.bool_()
    if column.kind == "integer":
        return pa.int32() if column.name in SHORT else pa.int64()
    return pa.float64() if column.name.startswith(("position_", "device_velocity_")) else pa.float32()


def _read(path: Path, kind: str) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    try:
        with parquet.ParquetFile(path) as file:
            facts = _facts(path, file.metadata)
            if facts["kind"] != kind:
                raise StoreError(f"{path} holds {facts['kind']}, not {kind}: name the other file of the trial")
            table = file.read().combine_chunks()
    except OSError as error:
        raise cannot_read(path, error) from error
    except (pa.ArrowException, UnicodeDecodeError) as error:
        raise _damaged(path, error) from error
    lacking = _LACKING[facts["format"]]
    every = FRAMES if kind == "frames" else SAMPLES
    columns = [column for column in every if column.name not in lacking]
    if not _are_of(table, columns, facts["rows"]):
        raise StoreError(f"{path} is damaged (its columns differ from those of {kind}): restore it from a copy")
    return {name: _numbers(table.column(name), facts["rows"]) for name in table.column_names}, facts


def _are_of(table: pa.Table, columns: Sequence[Column], rows: int) -> bool:
    """Return whether a table has these columns and no others, each once and whole."""
    expected = {column.name: column_type(column) for column in columns}
    held = {field.name: field.type for field in table.schema}
    return (
        table.num_rows == rows
        and len(table.column_names) == len(held)
        and held == expected
        and not any(column.null_count for column in table.columns)
    )


def _numbers(column: pa.ChunkedArray, rows: int) -> NDArray[Any]:
    if rows == 0:
        return np.empty(0)
    array = column.chunk(0)
    raw, end = array.buffers()[1], array.offset + rows
    if pa.types.is_boolean(array.type):
        return np.unpackbits(np.frombuffer(raw, np.uint8), count=end, bitorder="little")[array.offset :]
    return np.frombuffer(raw, array.type.to_pandas_dtype(), count=end)[array.offset :]


def _facts(path: Path, metadata: Any) -> dict[str, Any]:
    try:
        facts = parse_json(metadata.metadata[FACTS_KEY])
        if facts["format"] not in range(1, FORMAT + 1):
            found, readable = facts["format"], f"1 to {FORMAT}"
            raise StoreError(
                f"{path} has format {found!r}, this version reads {readable}: use a newer version of liquid-study"
            )
        if facts["kind"] == "samples":
            _check_facts_of_samples(facts, metadata.num_rows)
        return {**facts, "kind": facts["kind"], "rows": metadata.num_rows}
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise StoreError(f"{path} is not a recording of this program: restore it from a copy") from error


def _check_facts_of_samples(facts: Mapping[str, Any], rows: int) -> None:
    """Reject facts that must be numbers and are not (KeyError, TypeError or ValueError)."""
    if rows and "first_device_force_n" not in facts:
        raise KeyError("first_device_force_n")
    checks = facts["crc32"]
    whole = (checks["rows"], *checks["device_force"], *checks["effect_force"])
    if not all(isinstance(number, int) for number in whole):
        raise ValueError("its checks are invalid")
    for name in {"first_device_force_n", "first_command_n"} & facts.keys():
        first = facts[name]
        if len(first) not in (0, 3) or not all(number is None or isinstance(number, int | float) for number in first):
            raise ValueError(f"{name} is not a force")


def _damaged(path: Path, error: Exception) -> StoreError:
    reason = str(error).splitlines()[0] if str(error) else type(error).__name__
    return StoreError(f"{path} is damaged ({reason}): restore it from a copy")


class SamplesFile:
    """A recording being written: not there under its name until ``finish``."""

    def __init__(self, path: Path, facts: Mapping[str, Any], rate_hz: float) -> None:
        self.path = path
        self.check_rows = max(1, round(rate_hz))
        self.group_rows = self.check_rows * GROUP_SECONDS
        self.rows = 0
        self._held: list[Any] = []  # samples of the next group
        self._count = 0  # of them
        self._facts = {**facts, "rate_hz": rate_hz}
        self._half = _Half(path, SAMPLES)
        self._device: list[int] = []
        self._effect: list[int] = []

    def write(self, samples: Any) -> None:
        """Add the next samples (array of ``SAMPLE``); whole groups of them are written."""
        self._held.append(samples)
        self._count += len(samples)
        while self._count >= self.group_rows:
            together = np.concatenate(self._held)
            self._write_group(together[: self.group_rows])
            self._held, self._count = [together[self.group_rows :]], self._count - self.group_rows

    def _write_group(self, samples: Any) -> None:
        if self.rows == 0:
            self._facts["first_device_force_n"] = plain(samples["device_force_n"][:1].ravel())
            self._facts["first_command_n"] = plain(samples["command_n"][:1].ravel())
        self._device += crcs(samples["device_force_n"], self.check_rows)
        self._effect += crcs(samples["force_n"], self.check_rows)
        self._half.write(sample_columns(samples))
        self.rows += len(samples)

    def finish(self, dropped: int = 0) -> Written:
        """Close the file and put it in its place; ``dropped`` samples are known to be missing."""
        if self._count:
            self._write_group(np.concatenate(self._held))
        checks = {"rows": self.check_rows, "device_force": self._device, "effect_force": self._effect}
        facts = {"format": FORMAT, "kind": "samples", **self._facts, "dropped": dropped, "crc32": checks}
        return self._half.finish(facts, self.rows)

    def abandon(self) -> None:
        """Remove what was written."""
        self._half.abandon()


def write_frames(path: Path, frames: NDArray[np.int64], facts: Mapping[str, Any]) -> Written:
    """Write what was shown (n, 5): when painted, of which moment, and number, time and age of a video's frame [ns]."""
    half = _Half(path, FRAMES)
    try:
        painted, shown, *video = frames.T
        columns = {"painted_ns": painted, "sample_ns": shown, "age_ns": painted - shown}
        half.write({**columns, **dict(zip(NO_VIDEO, video, strict=True))})
        return half.finish({"format": FORMAT, "kind": "frames", **facts}, len(frames))
    except OSError:
        half.abandon()
        raise


def sample_columns(samples: Any) -> dict[str, NDArray[Any]]:
    """Return the columns of ``samples`` as they are kept: times and positions exact, the rest rounded."""
    columns: dict[str, NDArray[Any]] = {
        "tick": samples["tick"],
        "time_ns": samples["time_ns"],
        "due_ns": samples["time_ns"] - samples["lateness_ns"],
        **{name: samples[name] for name in ("fresh", *sorted(SHORT), "device_time_ns")},
    }
    with np.errstate(invalid="ignore", over="ignore"):  # values of a fault are stored unchanged
        device = _rounded(samples["device_force_n"], FORCE_STEP_N)
        undelivered = _rounded(samples["command_n"], FORCE_STEP_N) - device
        withheld = _rounded(samples["force_n"], FORCE_STEP_N) - device
        for i, axis in enumerate(AXES):
            columns[f"position_{axis}_m"] = samples["position_m"][:, i]
            columns[f"velocity_{axis}_mps"] = _rounded(samples["velocity_mps"][:, i], SPEED_STEP_MPS)
            columns[f"wake_{axis}_mps"] = _rounded(samples["wake_mps"][:, i], SPEED_STEP_MPS)
            columns[f"device_force_{axis}_n"] = device[:, i]
            columns[f"undelivered_{axis}_n"] = undelivered[:, i]
            columns[f"withheld_{axis}_n"] = withheld[:, i]
        for name, (field, component, bit) in MEASURED.items():
            values = samples[field] if component is None else samples[field][:, component]
            columns[name] = np.where(samples["measured"] & bit, values, np.nan)
        return {name: np.ascontiguousarray(column, _NUMPY_TYPES[name]) for name, column in columns.items()}


def _rounded(values: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    rounded: NDArray[np.float64] = np.rint(values / step) * step
    return rounded


class _Half:
    """A Parquet file under a temporary name, until it is whole."""

    def __init__(self, path: Path, columns: Sequence[Column]) -> None:
        self._path = path
        self._temporary = temporary_path(path)
        self._schema = _schema(columns)
        self._file: BinaryIO = self._temporary.open("xb")
        self._writer = parquet.ParquetWriter(
            self._file,
            self._schema,
            compression=_COMPRESSION[0],
            compression_level=_COMPRESSION[1],
            use_dictionary=False,
            write_statistics=False,
            column_encoding={field.name: _encoding(field.type) for field in self._schema},
        )

    def write(self, columns: Mapping[str, NDArray[Any]]) -> None:
        arrays = []
        for field in self._schema:  # without a copy, and without the library that Arrow would load to look at them
            values = columns[field.name]
            packs = pa.types.is_boolean(field.type)
            kept = np.packbits(values, bitorder="little") if packs else np.ascontiguousarray(values)
            arrays.append(pa.Array.from_buffers(field.type, len(values), [None, pa.py_buffer(kept)]))
        self._writer.write_batch(pa.RecordBatch.from_arrays(arrays, schema=self._schema))

    def finish(self, facts: Mapping[str, Any], rows: int) -> Written:
        self._writer.add_key_value_metadata({FACTS_KEY: json.dumps(facts, ensure_ascii=False)})
        self._writer.close()
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.close()
        with self._temporary.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        self._temporary.replace(self._path)
        sync_folder(self._path.parent)
        return Written(self._path, rows, digest)

    def abandon(self) -> None:
        for end in (self._writer.close, self._file.close):
            try:
                end()
            except OSError:  # a file that could not be written is not needed
                continue
        self._temporary.unlink(missing_ok=True)


def _schema(columns: Sequence[Column]) -> pa.Schema:
    fields = []
    for column in columns:
        metadata = {"description": column.description, **({"unit": column.unit} if column.unit else {})}
        fields.append(pa.field(column.name, column_type(column), nullable=False, metadata=metadata))
    return pa.schema(fields)


_NUMPY_TYPES = {column.name: column_type(column).to_pandas_dtype() for column in (*SAMPLES, *FRAMES)}


def _encoding(of: pa.DataType) -> str:
    if pa.types.is_boolean(of):
        return "RLE"
    return "BYTE_STREAM_SPLIT" if pa.types.is_floating(of) else "DELTA_BINARY_PACKED"
