import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from study_app.errors import ProtocolError, StudyError
from study_app.haptics.model.motion import Motion, read_motion
from study_app.store.files.csv_files import write_columns
from tests.haptics.scenes import examples

HEADER = "t_s,x_m,y_m,z_m"
numbers = st.floats(allow_nan=False, allow_infinity=False)


def motion_file(tmp_path, text):
    file = tmp_path / "motion.csv"
    file.write_bytes(text.encode() if isinstance(text, str) else text)
    return file


def problems(tmp_path, *rows, header=HEADER):
    """Return the problems of a file with these rows, one line each."""
    with pytest.raises(ProtocolError) as caught:
        read_motion(motion_file(tmp_path, "\n".join([header, *rows]) + "\n"))
    return [str(problem) for problem in caught.value.problems]


def test_positions_are_read_in_order(tmp_path):
    motion = read_motion(motion_file(tmp_path, f"{HEADER}\n0,1,2,3\n0.001,4,5,6e-1\n"))
    assert motion.t_s.tolist() == [0, 0.001]
    assert motion.position_m.tolist() == [[1, 2, 3], [4, 5, 0.6]]
    assert motion.velocity_mps is None


@pytest.mark.parametrize("header", ["x_m,t_s,y_m,z_m", "t,x,y,z", f"{HEADER},vx_mps", "0,1,2,3", ""])
def test_another_header_is_refused(tmp_path, header):
    (problem,) = problems(tmp_path, "0,1,2,3", header=header)
    assert problem.startswith("line 1: header: is ")
    assert "t_s,x_m,y_m,z_m" in problem


def test_every_bad_row_is_named_by_number_and_line(tmp_path):
    rows = ["0,0,0,0", "0.001,x,0,0", "0.002,0,0", "0.003,nan,0,0", "0.004,0,0,1_0", "0.004,1e999,0,0", "0.006,0,0,0"]
    assert problems(tmp_path, *rows) == [
        "line 3: row 2: 'x' is not a finite number",
        "line 4: row 3: has 3 fields, fewer than the 4 in the header",
        "line 5: row 4: 'nan' is not a finite number",
        "line 6: row 5: '1_0' is not a finite number",
        "line 7: row 6: '1e999' is not a finite number",
    ]


def test_time_must_increase(tmp_path):
    assert problems(tmp_path, "0,0,0,0", "0.002,0,0,0", "0.002,0,0,0", "0.001,0,0,0") == [
        "line 4: row 3: t_s must increase, but 0.002 follows 0.002",
        "line 5: row 4: t_s must increase, but 0.001 follows 0.002",
    ]


@pytest.mark.parametrize("content", [None, b"\xff\xfe\x00", b't_s,"x'])
def test_a_file_that_cannot_be_read_is_named(tmp_path, content):
    file = tmp_path / "absent.csv" if content is None else motion_file(tmp_path, content)
    with pytest.raises(StudyError, match=r"cannot read the motion file .*csv"):
        read_motion(file)


@pytest.mark.slow
@settings(max_examples=examples(50), deadline=None)
@given(values=arrays(float, st.tuples(st.integers(1, 20), st.just(3)), elements=numbers))
def test_written_columns_are_read_back_to_the_last_bit(tmp_path_factory, values):
    table = np.recarray(len(values), [(name, float) for name in HEADER.split(",")])
    table.t_s = np.arange(len(values)) / 3
    table.x_m, table.y_m, table.z_m = values.T
    file = tmp_path_factory.mktemp("motion") / "out.csv"
    write_columns(file, table)
    motion = read_motion(file)
    assert motion.t_s.tobytes() == table.t_s.tobytes()
    assert motion.position_m.tobytes() == np.ascontiguousarray(values).tobytes()


def test_a_failed_write_leaves_the_folder_unchanged(tmp_path):
    (tmp_path / "out.csv").mkdir()
    with pytest.raises(StudyError, match=r"out.csv cannot be written"):
        write_columns(tmp_path / "out.csv", np.recarray(1, [("t_s", float)], buf=np.zeros(1)))
    assert [file.name for file in tmp_path.iterdir()] == ["out.csv"]
    with pytest.raises(StudyError, match="cannot be written"):
        write_columns(tmp_path / "absent" / "out.csv", np.recarray(1, [("t_s", float)], buf=np.zeros(1)))


@pytest.mark.parametrize(
    ("t_s", "position_m", "velocity_mps", "message"),
    [
        ([], np.zeros((0, 3)), None, "not \\(0,\\)"),
        ([0.0], np.zeros((1, 2)), None, "positions of shape \\(n, 3\\)"),
        ([0.0, 1.0], np.zeros((2, 3)), np.zeros((1, 3)), "not \\(2,\\), \\(2, 3\\), \\(1, 3\\)"),
        ([0.0], np.full((1, 3), math.nan), None, "finite"),
        ([0.0, 1.0, 1.0], np.zeros((3, 3)), None, "row 3"),
    ],
)
def test_a_motion_checks_itself(t_s, position_m, velocity_mps, message):
    with pytest.raises(StudyError, match=message):
        Motion(np.array(t_s), position_m, velocity_mps=velocity_mps)


def test_a_device_is_not_read(tmp_path):
    """Reading a device such as /dev/zero never ends; the error repeats only a part of a bad value."""
    with pytest.raises(StudyError, match="it is a device, so reading may never end"):
        read_motion(Path("/dev/null"))
    assert len("".join(problems(tmp_path, "x" * 5000 + ",0,0,0"))) < 300
