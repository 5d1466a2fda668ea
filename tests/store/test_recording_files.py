import hashlib
import json
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from study_app.errors import StoreError
from study_app.haptics.model.layout import SAMPLE
from study_app.store.recordings import (
    SamplesFile,
    WrittenFile,
    crcs,
    describe_recording,
    opened_content,
    read_checks,
    read_facts,
    read_frames,
    read_samples,
    write_frames,
)
from tests.platforms import files_up_to
from tests.store.conftest import Make

EXACT = ("tick", "time_ns", "lateness_ns", "fresh", "buttons", "limiters", "scene", "status", "position_m")
FACTS = {"participant": "P007", "trial": 3}


def write(path: Path, samples: Any, rate_hz: float = 1000.0) -> WrittenFile:
    file = SamplesFile(path, FACTS, rate_hz)
    for first in range(0, len(samples), file.group_rows):
        file.write(samples[first : first + file.group_rows])
    assert file.received_rows == len(samples)
    return file.finish(dropped=0)


def test_each_second_of_forces_and_the_rest_have_a_crc_32() -> None:
    forces = np.arange(15).reshape(5, 3) / 7
    assert crcs(forces, 2) == [zlib.crc32(struct.pack("<6d", *forces.flat[at : at + 6])) for at in (0, 6)] + [
        zlib.crc32(struct.pack("<3d", *forces[4]))
    ]


@pytest.mark.slow
def test_times_and_positions_are_stored_exactly_and_other_values_in_steps(tmp_path: Path, samples_of: Make) -> None:
    samples = samples_of(61_234)
    recording = write(tmp_path / "trial-003.parquet", samples)
    rows_read = read_samples(recording.path)
    assert rows_read.dtype.fields == SAMPLE.fields
    assert (recording.rows, len(rows_read)) == (61_234, 61_234)
    metadata = parquet.read_metadata(recording.path)
    groups = [metadata.row_group(number) for number in range(metadata.num_row_groups)]
    assert [group.num_rows for group in groups] == [30_000, 30_000, 1_234], "30 s are compressed together"
    assert {group.column(column).compression for group in groups for column in range(metadata.num_columns)} == {"ZSTD"}
    for name in EXACT:
        assert np.array_equal(rows_read[name], samples[name]), name
    assert not rows_read["busy_ns"].any()
    for name in ("velocity_mps", "wake_mps"):
        assert np.abs(rows_read[name] - samples[name]).max() <= 2.0**-13
    for name in ("force_n", "device_force_n"):
        assert np.abs(rows_read[name] - samples[name]).max() <= 2.0**-15
    samples["command_n"][:3] += 0.5
    commanded = read_samples(write(tmp_path / "commanded.parquet", samples).path)["command_n"]
    assert np.abs(commanded - samples["command_n"]).max() <= 2.0**-14
    assert commanded[0].tolist() == samples["command_n"][0].tolist()
    assert rows_read["device_force_n"][0].tolist() == samples["device_force_n"][0].tolist()
    untouched = (samples["device_force_n"] == samples["force_n"]).all(axis=1)
    untouched[0] = False
    assert (rows_read["device_force_n"][untouched] == rows_read["force_n"][untouched]).all()


def test_measured_values_of_a_device_are_stored_and_its_velocity_exactly(tmp_path: Path, samples_of: Make) -> None:
    samples = samples_of(2_000)
    generator = np.random.default_rng(1)
    samples["measured"] = generator.integers(0, 16, 2_000)
    for name, bit in (("device_velocity_mps", 1), ("orientation", 2), ("gripper_m", 4), ("device_time_ns", 8)):
        field = samples[name]
        has = samples["measured"] & bit != 0
        field[has] = 1000 * generator.random(field[has].shape)
    path = write(tmp_path / "trial-003.parquet", samples).path
    rows_read = read_samples(path)
    for name in ("measured", "device_velocity_mps", "device_time_ns"):
        assert np.array_equal(rows_read[name], samples[name]), name
    for name in ("orientation", "gripper_m"):
        assert rows_read[name] == pytest.approx(samples[name], rel=1e-6), name
    table = parquet.read_table(path)
    assert (np.isnan(table["gripper_m"].to_numpy()) == (samples["measured"] & 4 == 0)).all()


def test_recordings_of_format_2_are_read_and_one_that_lacks_a_column_is_damaged(
    tmp_path: Path, samples_of: Make
) -> None:
    path = write(tmp_path / "trial-003.parquet", samples_of(100)).path
    whole, facts = parquet.read_table(path), json.loads(parquet.read_metadata(path).metadata[b"liquid_study"])

    def rewrite(table: pa.Table, told: dict[str, Any]) -> None:
        with parquet.ParquetWriter(path, table.schema) as writer:
            writer.write_table(table)
            writer.add_key_value_metadata({b"liquid_study": json.dumps(told)})

    rewrite(whole.select(whole.column_names[: whole.column_names.index("measured")]), facts | {"format": 2})
    rows_read = read_samples(path)
    assert not rows_read["measured"].any()
    assert np.array_equal(rows_read["position_m"], samples_of(100)["position_m"])
    at = whole.column_names.index("gripper_m")
    with_a_null = whole.set_column(at, "gripper_m", pa.array([None] + [0.5] * 99, whole.schema.field(at).type))
    for damaged in (whole.drop_columns("gripper_m"), with_a_null, whole.append_column("x", whole["gripper_m"])):
        rewrite(damaged, facts)
        with pytest.raises(StoreError, match="it does not have the columns of samples"):
            read_samples(path)
    rewrite(whole, facts | {"format": 5})
    with pytest.raises(
        StoreError, match="has format 5, but this version reads only formats 1 to 4: install a newer version"
    ):
        read_samples(path)


def test_numbers_of_a_fault_are_stored_unchanged(tmp_path: Path, samples_of: Make) -> None:
    samples = samples_of(4)
    samples["position_m"][1] = np.nan
    samples["velocity_mps"][1] = [np.inf, -np.inf, np.nan]
    samples["force_n"][1] = [np.nan, np.inf, 1e300]
    samples["device_force_n"][1] = [0.5, 0.25, 0.0]
    rows_read = read_samples(write(tmp_path / "trial-003.parquet", samples).path)
    assert np.isnan(rows_read["position_m"][1]).all()
    assert np.array_equal(rows_read["velocity_mps"][1], [np.inf, -np.inf, np.nan], equal_nan=True)
    assert np.array_equal(rows_read["force_n"][1], [np.nan, np.inf, np.inf], equal_nan=True)
    assert rows_read["device_force_n"][1].tolist() == [0.5, 0.25, 0.0]


@pytest.mark.slow
def test_the_checks_are_those_of_the_exact_forces_second_by_second(tmp_path: Path, samples_of: Make) -> None:
    samples = samples_of(32_500)
    checks = read_checks(write(tmp_path / "trial-003.parquet", samples).path)
    assert checks.rows == 1000
    assert len(checks.device_force) == len(checks.effect_force) == 33
    for check_values, name in ((checks.device_force, "device_force_n"), (checks.effect_force, "force_n")):
        for second, check in enumerate(check_values):
            rows = samples[name][1000 * second : 1000 * (second + 1)]
            exact = b"".join(struct.pack("<3d", *row) for row in rows.tolist())
            assert check == zlib.crc32(exact)
    samples["force_n"][7_500, 1] = np.nextafter(samples["force_n"][7_500, 1], 99)
    changed = read_checks(write(tmp_path / "again.parquet", samples).path)
    assert [second for second in range(33) if changed.effect_force[second] != checks.effect_force[second]] == [7]
    assert changed.device_force == checks.device_force


def test_the_facts_of_a_recording_are_read_without_its_rows(tmp_path: Path, samples_of: Make) -> None:
    facts = read_facts(write(tmp_path / "trial-003.parquet", samples_of(2_500), rate_hz=500).path)
    assert facts.pop("crc32")["rows"] == 500
    assert facts.pop("first_device_force_n") == facts.pop("first_command_n")
    assert facts == {"format": 4, "kind": "samples", **FACTS, "rate_hz": 500, "dropped": 0, "rows": 2_500}


def test_any_reader_of_parquet_finds_columns_with_unit_and_meaning(tmp_path: Path, samples_of: Make) -> None:
    recording = write(tmp_path / "trial-003.parquet", samples_of(100))
    frames = write_frames(tmp_path / "frames.parquet", np.array([[5, 3, -1, 0, -1]]), FACTS)
    for path in (recording.path, frames.path):
        assert all(field.metadata[b"description"] for field in parquet.read_schema(path))
        assert not any(field.nullable for field in parquet.read_schema(path))
    schema = parquet.read_schema(recording.path)
    for name, unit, description in (
        ("position_y_m", b"m", b"Exact position of the hand, up."),
        ("velocity_x_mps", b"m/s", b"Scene velocity from which the force was computed, to the right (resolution:"),
        ("device_force_z_n", b"N", b"Force that the device applied to the hand, toward the participant (resolution:"),
    ):
        metadata = schema.field(name).metadata
        assert (metadata[b"unit"], metadata[b"description"][: len(description)]) == (unit, description)


def test_frames_are_read_back_with_their_age(tmp_path: Path) -> None:
    tank_frames = [(10**15 + 16_666_667 * i, 10**15 + 16_666_667 * i - 4_000_000 - i) for i in range(1000)]
    video = [(i // 2, 10**15 + 33_333_333 * (i // 2), 80_000 + i) if i % 3 else (-1, 0, -1) for i in range(1000)]
    frames = np.array([(*of_tank, *of_video) for of_tank, of_video in zip(tank_frames, video, strict=True)])
    recording = write_frames(tmp_path / "trial-003_frames.parquet", frames, FACTS)
    frames_read = read_frames(recording.path)
    assert np.array_equal(frames_read["painted_ns"], frames[:, 0])
    assert np.array_equal(frames_read["sample_ns"], frames[:, 1])
    assert np.array_equal(frames_read["age_ns"], frames[:, 0] - frames[:, 1])
    assert [tuple(row) for row in frames_read[["video_frame", "video_ns", "video_age_ns"]].tolist()] == video


@pytest.mark.parametrize("secret", [None, b"s" * 32])
def test_a_recording_on_the_disk_is_described_as_it_was_written(
    tmp_path: Path, samples_of: Make, secret: bytes | None
) -> None:
    file = SamplesFile(tmp_path / "trial-003.parquet", FACTS, 1000.0, secret)
    file.write(samples_of(70))
    frames = write_frames(tmp_path / "frames.parquet", np.array([[7, 3, 5, 11, 13]] * 2), FACTS, 0.07, secret)
    for recording, rows in ((file.finish(dropped=5), 70), (frames, 2)):
        assert describe_recording(recording.path, secret) == recording
        content = recording.path.read_bytes()
        assert (recording.rows, recording.sha256) == (rows, hashlib.sha256(content).hexdigest())
        open_digest = hashlib.sha256(opened_content(recording.path, content, secret)).hexdigest()
        assert recording.opened_sha256 == (None if secret is None else open_digest)
        assert (open_digest == recording.sha256) == (secret is None)
    assert read_facts(file.path, secret)["dropped"] == 5


def test_frames_of_format_3_are_those_of_sessions_without_a_video(tmp_path: Path) -> None:
    path = write_frames(tmp_path / "trial-003_frames.parquet", np.array([[7, 3, 5, 11, 13]]), FACTS).path
    whole, facts = parquet.read_table(path), json.loads(parquet.read_metadata(path).metadata[b"liquid_study"])
    earlier = whole.select(["painted_ns", "sample_ns", "age_ns"])
    with parquet.ParquetWriter(path, earlier.schema) as writer:
        writer.write_table(earlier)
        writer.add_key_value_metadata({b"liquid_study": json.dumps(facts | {"format": 3})})
    assert read_frames(path).tolist() == [(7, 3, 4, -1, 0, -1)]


def test_a_file_that_is_not_a_recording_is_named(tmp_path: Path, samples_of: Make) -> None:
    samples = write(tmp_path / "trial-003.parquet", samples_of(100)).path
    frames = write_frames(tmp_path / "frames.parquet", np.array([[5, 3, -1, 0, -1]]), FACTS).path
    other = tmp_path / "other.parquet"
    parquet.write_table(pa.table({"x": pa.array([1])}), other)
    torn = tmp_path / "torn.parquet"
    torn.write_bytes(samples.read_bytes()[:-20])
    for act, path, message in (
        (read_frames, samples, "contains samples, not frames"),
        (read_samples, frames, "contains frames, not samples"),
        (read_checks, frames, "contains frames, not samples"),
        (read_samples, other, "is not a recording made by this program"),
        (read_samples, torn, r"is damaged \(Parquet magic bytes not found in footer"),
        (read_facts, torn, r"is damaged \(Parquet magic bytes not found in footer"),
        (read_samples, tmp_path / "none.parquet", "cannot be read"),
        (read_facts, tmp_path / "none.parquet", "cannot be read"),
    ):
        with pytest.raises(StoreError, match=message) as refusal:
            act(path)
        assert path.name in str(refusal.value)
        assert "\n" not in str(refusal.value)


def test_frames_that_do_not_fit_on_the_disk_leave_no_file(tmp_path: Path) -> None:
    frames = np.random.default_rng(1).integers(0, 2**60, (50_000, 5))
    with files_up_to(10_000), pytest.raises(StoreError, match="File too large"):
        write_frames(tmp_path / "frames.parquet", frames, FACTS)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "changed",
    [
        {"first_device_force_n": [1.0, 2.0]},
        {"first_device_force_n": [1.0, 2.0, "3"]},
        {"first_command_n": [1.0]},
        {"first_command_n": 7},
        {"crc32": {"rows": 1.5, "device_force": [1], "effect_force": [2]}},
        {"crc32": {"rows": 1, "device_force": [1.5], "effect_force": [2]}},
        {"crc32": {"rows": 1, "device_force": [1], "effect_force": ["2"]}},
        {"crc32": {"rows": 1, "device_force": [1]}},
        {"first_device_force_n": None},
        {"first_device_force_n": ...},
    ],
    ids=str,
)
def test_a_wrong_fact_of_samples_is_reported_before_they_are_read(
    tmp_path: Path, samples_of: Make, changed: dict[str, Any]
) -> None:
    path = write(tmp_path / "trial-003.parquet", samples_of(10)).path
    whole, facts = parquet.read_table(path), json.loads(parquet.read_metadata(path).metadata[b"liquid_study"])
    for claimed, is_wrong in ((facts | {"first_device_force_n": [1, None, 0.5]}, False), (facts | changed, True)):
        with parquet.ParquetWriter(path, whole.schema) as writer:
            writer.write_table(whole)
            writer.add_key_value_metadata(
                {b"liquid_study": json.dumps({name: fact for name, fact in claimed.items() if fact is not ...})}
            )
        if is_wrong:
            with pytest.raises(StoreError, match=r"trial-003\.parquet is not a recording made by this program"):
                read_facts(path)
        else:
            assert read_facts(path)["rows"] == 10
