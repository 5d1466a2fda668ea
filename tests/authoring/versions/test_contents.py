import os
import subprocess
import sys
from pathlib import Path

import pytest

from study_app.authoring.versions.contents import ChangedOutsideError, content_hash, kept_content, kept_versions, save
from study_app.user_folder import data_folder


def test_save_replaces_the_file_keeps_its_permissions_and_its_previous_content(tmp_path: Path) -> None:
    file, link = tmp_path / "study.toml", tmp_path / "link.toml"
    file.write_bytes(b"a = 1\r\n")
    file.chmod(0o640)
    link.symlink_to(file)
    base = content_hash(b"a = 1\r\n")
    after = save(link, "a = 2\r\n", base)
    assert file.read_bytes() == b"a = 2\r\n"
    assert link.is_symlink()
    assert file.stat().st_mode & 0o777 == 0o640
    assert kept_content(base) == b"a = 1\r\n"
    assert kept_content(after) == b"a = 2\r\n"
    assert kept_content("0" * 64) is None
    assert [(kept.hash, kept.origin) for kept in kept_versions(file)] == [(base, "found"), (after, "saved")]
    save(file, "a = 1\r\n", after)
    assert [kept.hash for kept in kept_versions(link)] == [base, after]


def test_save_refuses_a_file_that_another_program_changed(tmp_path: Path) -> None:
    file = tmp_path / "study.toml"
    base = save(file, "a = 1\n", "")
    with pytest.raises(ChangedOutsideError, match="changed by another program"):
        save(file, "a = 2\n", "")
    file.write_text("b = 1\n")
    with pytest.raises(ChangedOutsideError, match="changed by another program"):
        save(file, "a = 2\n", base)
    assert file.read_text() == "b = 1\n"
    file.unlink()
    with pytest.raises(ChangedOutsideError, match="deleted or moved"):
        save(file, "a = 2\n", base)


def test_lines_of_the_list_that_cannot_be_read_are_left_out(tmp_path: Path) -> None:
    file = tmp_path / "study.toml"
    base = save(file, "a = 1\n", "")
    (path,) = (data_folder() / "versions").glob("*.jsonl")
    path.write_bytes(b'{"hash": "torn\n[]\n{"hash": "x", "origin": "else"}\n' + path.read_bytes())
    assert [kept.hash for kept in kept_versions(file)] == [base]


SAVING = """
import sys
from pathlib import Path
from study_app.authoring.versions.contents import ChangedOutsideError, content_hash, kept_content, save
from study_app.errors import StoreError
file, name, saved = Path(sys.argv[1]), sys.argv[2], 0
while saved < 20:
    before = file.read_bytes()
    text = before.decode() + f"{name}{saved} = 1\\n"
    try:
        save(file, text, content_hash(before))
    except ChangedOutsideError:
        continue
    except StoreError:
        continue
    saved += 1
"""


@pytest.mark.slow
def test_two_programs_that_save_one_file_lose_nothing(tmp_path: Path) -> None:
    file = tmp_path / "study.toml"
    file.write_text("")
    programs = [subprocess.Popen([sys.executable, "-c", SAVING, str(file), name]) for name in "ab"]
    assert [program.wait(120) for program in programs] == [0, 0]
    expected = {f"{name}{number} = 1" for name in "ab" for number in range(20)}
    assert set(file.read_text().splitlines()) == expected
    assert len(list(Path(os.environ["LIQUID_STUDY_DATA"], "contents").glob("*.toml"))) == 41
