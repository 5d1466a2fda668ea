"""The files of a trial's recording: every sample of the servo, and every frame that was shown, as Parquet.

Times, positions and velocities measured by the device are stored exactly, so that the trial can be recomputed; computed
velocities and forces are rounded to steps far below the resolution of device and hand, so that half an hour at 1 kHz
takes 30 to 56 MB; a measured velocity adds 43 MB at most. A CRC-32 per second of the exact computed forces allows a
replay to check them.

Positions, velocities and forces are in the frames of ``haptics.model.layout.SAMPLE``. Any Parquet reader can read the
columns, with unit and meaning in each column's metadata. Until the study is unblinded the files are sealed as a whole
(see `blinded.sealing`), and reading them requires the secret of the study's key.
"""

import contextlib
import hashlib
import io
import json
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
from numpy.typing import NDArray
from pyarrow import parquet

from study_app.errors import StoreError
from study_app.haptics.model.layout import SAMPLE, SAMPLE_FIELDS, records
from study_app.store.blinded.sealing import MARK, frames_bytes, open_file, samples_bytes, seal_file
from study_app.store.files.atomic import cannot_read, parse_json, read_regular, write_file
from study_app.store.files.columns import FRAMES, SAMPLES
from study_app.store.files.csv_files import Column
from study_app.store.journals.journal_events import plain_json

_FORMAT = 4
_RECORDED_FIELDS = tuple(field for field in SAMPLE_FIELDS if field.meaning)
ROUNDED_TO = {field.name: field.step for field in _RECORDED_FIELDS if field.step}
"""Fields of ``layout.SAMPLE`` that are recorded rounded, and the step."""
_FRAME = np.dtype([(column.name, np.int64) for column in FRAMES])
_NO_VIDEO = {"video_frame": -1, "video_ns": 0, "video_age_ns": -1}
"""Values of a frame without a video."""
_FACTS_KEY = b"liquid_study"
_VIDEO_SINCE = 4
"""First format of recordings whose frames have numbers and times of a video."""
_GROUP_SECONDS = 30  # seconds of rows that are compressed together
_COMPRESSION = ("zstd", 9)
_STORED = {
    **{name: pa.from_numpy_dtype(field.stored) for field in _RECORDED_FIELDS for name in field.named()},
    **{column.name: pa.int64() for column in FRAMES},
}


@dataclass(frozen=True, slots=True)
class WrittenFile:
    """A complete recording on the disk; for a sealed one, also the SHA-256 of the opened file."""

    path: Path
    rows: int
    sha256: str
    opened_sha256: str | None = None


class SealedRecording(StoreError):
    """A recording that cannot be read before the study is unblinded."""


@dataclass(frozen=True, slots=True)
class Checks:
    """CRC-32 of the float64 forces (little-endian, x y z per row): of every ``rows`` rows, and of the remainder."""

    rows: int
    device_force: tuple[int, ...]
    effect_force: tuple[int, ...]


def read_samples(path: Path, secret: bytes | None = None) -> Any:
    """Return the samples (n,) as a recarray of ``SAMPLE``; ``busy_ns``, which is not recorded, is 0.

    A sealed recording is read with the ``secret`` of the study's key.

    The first sample's force on the hand, from which a replay starts, is exact. Recordings of format 1 assume that
    every device sends the commanded force one tick late; until format 2 no device measured its velocity.

    Raises
    ------
    StoreError
        The file cannot be read, is not a recording of samples, or is sealed.
    """
    columns, facts = _read_columns(path, "samples", secret)
    samples = records(SAMPLE, len(columns["tick"]))
    for field in _RECORDED_FIELDS:
        values: Any = field.before
        if field.since <= facts["format"]:
            values = np.column_stack([columns[name] for name in field.named()])
            if field.measured:
                values = np.where(columns["measured"][:, np.newaxis] & field.measured, values, 0.0)
        if field.beside:
            values = _component_rows(samples, field.beside) + field.sign * values
        _component_rows(samples, field.name)[:] = values
    if len(samples) and None not in facts["first_device_force_n"]:
        samples["device_force_n"][0] = facts["first_device_force_n"]
        samples["command_n"][0] = facts.get("first_command_n", facts["first_device_force_n"])
    return samples


def read_frames(path: Path, secret: bytes | None = None) -> Any:
    """Return the frames (n,) as a recarray of `_FRAME`: the times of painting, shown sample and video frame [ns].

    Raises
    ------
    StoreError
        The file cannot be read, is not a recording of frames, or is sealed.
    """
    columns, _ = _read_columns(path, "frames", secret)
    frames = records(_FRAME, len(columns["painted_ns"]))
    for name in _FRAME.names or ():
        frames[name] = columns.get(name, _NO_VIDEO.get(name, 0))
    return frames


def read_facts(path: Path, secret: bytes | None = None) -> dict[str, Any]:
    """Return the file's metadata without reading its rows: facts, ``kind`` and ``rows``."""
    with _open_parquet(path, secret) as file:
        return _parse_facts(path, file.metadata)


def describe_recording(path: Path, secret: bytes | None = None) -> WrittenFile:
    """Return path, row count and checksums of a recording on the disk."""
    rows = read_facts(path, secret)["rows"]
    content = read_regular(path)
    file_hash, opened = (hashlib.sha256(data).hexdigest() for data in (content, opened_content(path, content, secret)))
    return WrittenFile(path, rows, file_hash, None if opened == file_hash else opened)


def read_checks(path: Path, secret: bytes | None = None) -> Checks:
    """Return the CRCs of a recording of samples.

    Raises
    ------
    StoreError
        The file cannot be read, or has no CRCs.
    """
    facts = read_facts(path, secret)
    if facts["kind"] != "samples":
        raise StoreError(f"{path} contains {facts['kind']}, not samples: specify the recording of samples")
    checks = facts["crc32"]
    return Checks(checks["rows"], tuple(checks["device_force"]), tuple(checks["effect_force"]))


def crcs(forces: NDArray[np.float64], rows: int) -> list[int]:
    """Return the CRC-32 of every ``rows`` forces (n, 3) [N], and of the remainder."""
    little_endian = np.ascontiguousarray(forces, "<f8")
    return [zlib.crc32(little_endian[first : first + rows].tobytes()) for first in range(0, len(little_endian), rows)]


def opened_content(path: Path, content: bytes, secret: bytes | None) -> bytes:
    """Return the content of a recording, opened with the key's ``secret`` if it is sealed (StoreError without one)."""
    if not content.startswith(MARK):
        return content
    if secret is None:
        raise SealedRecording(
            f"{path} is sealed until the study is unblinded: run liquid-study unblind RESULTS to open it"
        )
    if (opened := open_file(content, secret)) is None:
        raise StoreError(
            f"{path} cannot be decrypted with the study's key: it has been changed; restore it from a backup"
        )
    return opened


@contextlib.contextmanager
def _open_parquet(path: Path, secret: bytes | None) -> Iterator[Any]:
    """Open a recording as Parquet, converting read errors to StoreError."""
    try:
        with parquet.ParquetFile(pa.BufferReader(opened_content(path, read_regular(path), secret))) as file:
            yield file
    except OSError as error:
        raise cannot_read(path, error) from error
    except (pa.ArrowException, UnicodeDecodeError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise StoreError(f"{path} is damaged ({reason}): restore it from a backup") from error


def _read_columns(path: Path, kind: str, secret: bytes | None) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    with _open_parquet(path, secret) as file:
        facts = _parse_facts(path, file.metadata)
        if facts["kind"] != kind:
            raise StoreError(f"{path} contains {facts['kind']}, not {kind}: specify the trial's other file")
        table = file.read().combine_chunks()
    file_format = facts["format"]
    if kind == "frames":
        columns = [column.name for column in FRAMES if file_format >= _VIDEO_SINCE or column.name not in _NO_VIDEO]
    else:
        columns = [name for field in _RECORDED_FIELDS if field.since <= file_format for name in field.named()]
    if not _has_columns(table, columns, facts["rows"]):
        raise StoreError(f"{path} is damaged (it does not have the columns of {kind}): restore it from a backup")
    return {name: _column_values(table.column(name), facts["rows"]) for name in table.column_names}, facts


def _has_columns(table: pa.Table, columns: Sequence[str], rows: int) -> bool:
    """Return whether a table has exactly these columns, each once and with all rows."""
    expected = {name: _STORED[name] for name in columns}
    actual = {field.name: field.type for field in table.schema}
    return (
        table.num_rows == rows
        and len(table.column_names) == len(actual)
        and actual == expected
        and not any(column.null_count for column in table.columns)
    )


def _column_values(column: pa.ChunkedArray, rows: int) -> NDArray[Any]:
    if rows == 0:
        return np.empty(0, column.type.to_pandas_dtype())
    array = column.chunk(0)
    raw, end = array.buffers()[1], array.offset + rows
    if pa.types.is_boolean(array.type):
        return np.unpackbits(np.frombuffer(raw, np.uint8), count=end, bitorder="little")[array.offset :]
    return np.frombuffer(raw, array.type.to_pandas_dtype(), count=end)[array.offset :]


def _parse_facts(path: Path, metadata: Any) -> dict[str, Any]:
    try:
        facts = parse_json(metadata.metadata[_FACTS_KEY])
        if facts["format"] not in range(1, _FORMAT + 1):
            version, readable = facts["format"], f"1 to {_FORMAT}"
            raise StoreError(
                f"{path} has format {version!r}, but this version reads only formats {readable}: install a newer "
                "version"
            )
        if facts["kind"] == "samples":
            _check_sample_facts(facts, metadata.num_rows)
        return {**facts, "kind": facts["kind"], "rows": metadata.num_rows}
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise StoreError(f"{path} is not a recording made by this program: restore it from a backup") from error


def _check_sample_facts(facts: Mapping[str, Any], rows: int) -> None:
    """Raise KeyError, TypeError or ValueError if a number is missing or has another type."""
    if rows and "first_device_force_n" not in facts:
        raise KeyError("first_device_force_n")
    checks = facts["crc32"]
    integers = (checks["rows"], *checks["device_force"], *checks["effect_force"])
    if not all(isinstance(number, int) for number in integers):
        raise ValueError("its checks are invalid")
    for name in {"first_device_force_n", "first_command_n"} & facts.keys():
        force_n = facts[name]
        if len(force_n) not in (0, 3) or not all(
            number is None or isinstance(number, int | float) for number in force_n
        ):
            raise ValueError(f"{name} does not contain three force components")


class SamplesFile:
    """A recording in progress: in memory until ``finish``, which seals it if there is a ``secret``."""

    def __init__(self, path: Path, facts: Mapping[str, Any], rate_hz: float, secret: bytes | None = None) -> None:
        self.path = path
        self.received_rows = 0
        self._secret = secret
        self.check_rows = max(1, round(rate_hz))
        self.group_rows = self.check_rows * _GROUP_SECONDS
        self.rows = 0
        self._buffer: list[Any] = []  # samples of the next group
        self._buffered_rows = 0  # in _buffer
        self._facts = {**facts, "rate_hz": rate_hz}
        self._pending = _PendingFile(path, SAMPLES)
        self._device: list[int] = []
        self._effect: list[int] = []

    def write(self, samples: Any) -> None:
        """Add the next samples (array of ``SAMPLE``); complete row groups are written."""
        self._buffer.append(samples)
        self.received_rows += len(samples)
        self._buffered_rows += len(samples)
        while self._buffered_rows >= self.group_rows:
            together = np.concatenate(self._buffer)
            self._write_group(together[: self.group_rows])
            self._buffer, self._buffered_rows = [together[self.group_rows :]], self._buffered_rows - self.group_rows

    def _write_group(self, samples: Any) -> None:
        if self.rows == 0:
            self._facts["first_device_force_n"] = plain_json(samples["device_force_n"][:1].ravel())
            self._facts["first_command_n"] = plain_json(samples["command_n"][:1].ravel())
        self._device += crcs(samples["device_force_n"], self.check_rows)
        self._effect += crcs(samples["force_n"], self.check_rows)
        self._pending.write(_sample_columns(samples))
        self.rows += len(samples)

    def finish(self, dropped: int = 0) -> WrittenFile:
        """Complete the file and write it to its path; ``dropped`` is the number of missing samples."""
        if self._buffered_rows:
            self._write_group(np.concatenate(self._buffer))
        checks = {"rows": self.check_rows, "device_force": self._device, "effect_force": self._effect}
        facts = {"format": _FORMAT, "kind": "samples", **self._facts, "dropped": dropped, "crc32": checks}
        rate_hz = self._facts["rate_hz"]
        size = samples_bytes((self.rows + dropped) / rate_hz, rate_hz)
        return self._pending.finish(facts, self.rows, size, self._secret)


def write_frames(
    path: Path, frames: NDArray[np.int64], facts: Mapping[str, Any], seconds: float = 0.0, secret: bytes | None = None
) -> WrittenFile:
    """Write the shown frames (n, 5): time painted, time shown, and number, time and age of the video frame [ns].

    With a ``secret`` they are sealed; the file's size then depends only on the recording's length in ``seconds``.
    """
    file = _PendingFile(path, FRAMES)
    painted, shown, *video = frames.T
    columns = {"painted_ns": painted, "sample_ns": shown, "age_ns": painted - shown}
    file.write({**columns, **dict(zip(_NO_VIDEO, video, strict=True))})
    size = frames_bytes(seconds)
    return file.finish({"format": _FORMAT, "kind": "frames", **facts}, len(frames), size, secret)


def _sample_columns(samples: Any) -> dict[str, NDArray[Any]]:
    """Return the columns of ``samples`` as recorded: times and positions exact, other fields rounded."""
    columns: dict[str, NDArray[Any]] = {}
    with np.errstate(invalid="ignore", over="ignore"):  # non-finite values of a fault are stored unchanged
        for field in _RECORDED_FIELDS:
            values = _round_values(_component_rows(samples, field.name), field.step)
            if field.beside:
                values = field.sign * (values - _round_values(_component_rows(samples, field.beside), field.step))
            if field.measured:
                values = np.where(samples["measured"][:, np.newaxis] & field.measured, values, np.nan)
            for name, column in zip(field.named(), values.T, strict=True):
                columns[name] = np.ascontiguousarray(column, field.stored)
    return columns


def _component_rows(samples: Any, name: str) -> NDArray[Any]:
    """Return a field of samples as an array of shape (samples, components), which is a view."""
    return np.reshape(samples[name], (len(samples), SAMPLE[name].shape[0] if SAMPLE[name].shape else 1))


def _round_values(values: NDArray[Any], step: float) -> NDArray[Any]:
    return np.asarray(np.rint(values / step) * step) if step else values


class _PendingFile:
    """A Parquet file in memory until it is complete; half an hour takes 60 MB."""

    def __init__(self, path: Path, columns: Sequence[Column]) -> None:
        self._path = path
        self._schema = _schema(columns)
        self._file = io.BytesIO()
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
        for field in self._schema:  # from_buffers neither copies nor loads the library with which Arrow inspects arrays
            values = columns[field.name]
            is_boolean = pa.types.is_boolean(field.type)
            buffer = np.packbits(values, bitorder="little") if is_boolean else np.ascontiguousarray(values)
            arrays.append(pa.Array.from_buffers(field.type, len(values), [None, pa.py_buffer(buffer)]))
        self._writer.write_batch(pa.RecordBatch.from_arrays(arrays, schema=self._schema))

    def finish(self, facts: Mapping[str, Any], rows: int, size: int, secret: bytes | None) -> WrittenFile:
        """Write the file in one step; with a ``secret`` only the sealed content ever reaches the disk."""
        self._writer.add_key_value_metadata({_FACTS_KEY: json.dumps(facts, ensure_ascii=False)})
        self._writer.close()
        content = self._file.getvalue()
        opened_hash = hashlib.sha256(content).hexdigest()
        if secret is None:
            write_file(self._path, content)
            return WrittenFile(self._path, rows, opened_hash)
        sealed = seal_file(content, size, secret)
        write_file(self._path, sealed)
        return WrittenFile(self._path, rows, hashlib.sha256(sealed).hexdigest(), opened_hash)


def _schema(columns: Sequence[Column]) -> pa.Schema:
    fields = []
    for column in columns:
        metadata = {"description": column.description, **({"unit": column.unit} if column.unit else {})}
        fields.append(pa.field(column.name, _STORED[column.name], nullable=False, metadata=metadata))
    return pa.schema(fields)


def _encoding(type_: pa.DataType) -> str:
    if pa.types.is_boolean(type_):
        return "RLE"
    return "BYTE_STREAM_SPLIT" if pa.types.is_floating(type_) else "DELTA_BINARY_PACKED"
