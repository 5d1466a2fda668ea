"""Recordings being written: samples group by group while a trial runs, frames at its end."""

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
from numpy.typing import NDArray
from pyarrow import parquet

from study_app.haptics.model.layout import FORCE_STEP_N
from study_app.store.atomic import sync_folder, temporary_path
from study_app.store.journals.journal import plain
from study_app.store.recording_files import (
    AXES,
    FACTS_KEY,
    FORMAT,
    MEASURED,
    NO_VIDEO,
    SHORT,
    SPEED_STEP_MPS,
    Written,
    column_type,
    crcs,
)
from study_app.store.tables.column import Column
from study_app.store.tables.recorded_columns import FRAMES, SAMPLES

GROUP_SECONDS = 30  # rows of so many seconds are compressed together
_COMPRESSION = ("zstd", 9)


class SamplesFile:
    """A recording being written: not there under its name until ``finish``.

    Parameters
    ----------
    path : Path
        Where it is to be.
    facts : mapping
        Metadata of the samples, stored in the file; they must not reveal a condition.
    rate_hz : float
        Samples a second, nominally.

    Raises
    ------
    OSError
        From every method: the disk rejects the write.
    """

    def __init__(self, path: Path, facts: Mapping[str, Any], rate_hz: float) -> None:
        self.path = path
        self.check_rows = max(1, round(rate_hz))
        self.group_rows = self.check_rows * GROUP_SECONDS
        self.rows = 0
        self._facts = {**facts, "rate_hz": rate_hz}
        self._half = _Half(path, SAMPLES)
        self._device: list[int] = []
        self._effect: list[int] = []

    def write(self, samples: Any) -> None:
        """Add a group of samples (array of ``SAMPLE``): ``group_rows`` of them, except the last time."""
        if self.rows == 0:
            self._facts["first_device_force_n"] = plain(samples["device_force_n"][:1].ravel())
            self._facts["first_command_n"] = plain(samples["command_n"][:1].ravel())
        self._device += crcs(samples["device_force_n"], self.check_rows)
        self._effect += crcs(samples["force_n"], self.check_rows)
        self._half.write(sample_columns(samples))
        self.rows += len(samples)

    def finish(self, dropped: int = 0) -> Written:
        """Close the file and put it in its place; ``dropped`` samples are known to be missing."""
        checks = {"rows": self.check_rows, "device_force": self._device, "effect_force": self._effect}
        facts = {"format": FORMAT, "kind": "samples", **self._facts, "dropped": dropped, "crc32": checks}
        return self._half.finish(facts, self.rows)

    def abandon(self) -> None:
        """Remove what was written."""
        self._half.abandon()


def write_frames(path: Path, frames: NDArray[np.int64], facts: Mapping[str, Any]) -> Written:
    """Write what was shown (n, 5): when painted, of which moment, and number, time and age of a video's frame [ns].

    Raises
    ------
    OSError
        The disk rejects the write; nothing is left.
    """
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
        arrays = [_array(columns[field.name], field.type) for field in self._schema]
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


def _array(values: NDArray[Any], of: pa.DataType) -> pa.Array:
    """Return ``values`` for Arrow without a copy, and without the library that it would load to look at them."""
    kept = np.packbits(values, bitorder="little") if pa.types.is_boolean(of) else np.ascontiguousarray(values)
    return pa.Array.from_buffers(of, len(values), [None, pa.py_buffer(kept)])
