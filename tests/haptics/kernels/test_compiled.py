import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from numba.core.errors import NumbaError

from study_app.haptics.kernels import compiled
from study_app.haptics.kernels.compiled import (
    KEPT_FOLDERS,
    SWEPT_AT_ONCE,
    UNUSED_S,
    kernel,
    part,
    sweep_caches,
    workings,
)
from tests.haptics.scenes import COMPILED

pytestmark = pytest.mark.slow

about_compiled_code = pytest.mark.skipif(not COMPILED, reason="about compiled code")


@about_compiled_code
@pytest.mark.parametrize("decorator", [kernel, part])
def test_code_of_the_servo_that_would_allocate_does_not_compile(decorator):
    @decorator
    def make(count):
        return np.zeros(count)[0]

    with pytest.raises((NumbaError, NotImplementedError)):
        make(3)


@about_compiled_code
def test_evaluation_may_make_arrays():
    @workings
    def make(count):
        return np.zeros(count)

    assert len(make(3)) == 3


def caches(folder: Path, ages_s: list[float]) -> list[Path]:
    """Make caches of other sources that were last used so long ago; the oldest names sort in any order."""
    made = []
    for number, age_s in enumerate(ages_s):
        path = folder / f"{(number * 7919) % 10_007:016x}"
        (path / "haptics").mkdir(parents=True)
        (path / "haptics" / "tick.nbi").write_bytes(b"x")
        os.utime(path, (time.time() - age_s,) * 2)
        made.append(path)
    return made


def there(paths: list[Path]) -> list[bool]:
    return [path.exists() for path in paths]


def test_the_newest_caches_stay_and_the_oldest_go_a_few_at_a_time(tmp_path: Path) -> None:
    own = tmp_path / ("f" * 16)
    own.mkdir()
    old = caches(tmp_path, [UNUSED_S * (2 + number) for number in range(KEPT_FOLDERS + SWEPT_AT_ONCE)])
    (tmp_path / "somebody-elses").mkdir()
    sweep_caches(own)
    assert there(old) == [True] * KEPT_FOLDERS + [False] * SWEPT_AT_ONCE
    sweep_caches(own)
    assert there(old) == [True] * (KEPT_FOLDERS - 1) + [False] * (SWEPT_AT_ONCE + 1)
    sweep_caches(own)
    assert sum(there(old)) == KEPT_FOLDERS - 1
    assert sorted(path.name for path in tmp_path.iterdir() if path not in old) == ["f" * 16, "somebody-elses"]


def test_what_was_used_within_a_day_stays_however_much_it_is(tmp_path: Path) -> None:
    own = tmp_path / ("f" * 16)
    own.mkdir()
    recent = caches(tmp_path, [UNUSED_S * 0.9] * 3 * KEPT_FOLDERS)
    sweep_caches(own)
    assert all(there(recent))


def test_a_cache_that_a_program_begins_with_meanwhile_is_given_back(tmp_path: Path) -> None:
    (path,) = caches(tmp_path, [UNUSED_S * 9])
    seen_at = path.stat().st_mtime
    os.utime(path)
    compiled.remove_cache(path, seen_at)
    assert (path / "haptics" / "tick.nbi").read_bytes() == b"x"
    assert list(tmp_path.iterdir()) == [path]


def test_what_a_killed_program_had_begun_to_remove_goes(tmp_path: Path) -> None:
    own = tmp_path / ("f" * 16)
    own.mkdir()
    half = tmp_path / ".0123456789abcdef.0a1b2c3d.gone"
    half.mkdir()
    old = caches(tmp_path, [UNUSED_S * 2] * (KEPT_FOLDERS - 1))
    sweep_caches(own)
    assert not half.exists()
    assert all(there(old))


def test_programs_that_begin_at_once_sweep_without_a_word_and_use_one_cache(tmp_path: Path) -> None:
    old = caches(tmp_path, [UNUSED_S * 40] * (KEPT_FOLDERS + 12))
    begin = [sys.executable, "-c", "from study_app.haptics.kernels import compiled"]
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    programs = [
        subprocess.Popen(begin, env=environment, stderr=subprocess.PIPE, cwd=Path(__file__).parents[3])
        for _ in range(4)
    ]
    for program in programs:
        _, said = program.communicate(timeout=120)
        assert (program.returncode, said) == (0, b"")
    (own,) = [path for path in tmp_path.iterdir() if path not in old]
    assert len(own.name) == 16
    assert KEPT_FOLDERS - 1 <= sum(there(old)) <= len(old) - SWEPT_AT_ONCE


def said_at_start(folder: Path, environment: dict[str, str]) -> tuple[str, str]:
    """Start an interpreter that compiles a file in ``folder``; return where it keeps that, and what it said."""
    program = folder / "program.py"
    program.write_text(
        "from study_app.haptics.kernels import compiled\n"
        "@compiled.kernel\n"
        "def twice(x): return 2 * x\n"
        "assert twice(21) == 42\n"
        "print(compiled.CACHE)"
    )
    done = subprocess.run(
        [sys.executable, str(program)],
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[3])} | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip(), done.stderr


@pytest.fixture
def nowhere(tmp_path: Path) -> Path:
    """Return a place that no folder can be made in, whoever asks: it is a file."""
    file = tmp_path / "file"
    file.write_text("no folder")
    return file / "cache"


about_user_cache = pytest.mark.skipif(sys.platform != "linux", reason="XDG_CACHE_HOME is Linux's")


@about_user_cache
def test_a_cache_that_cannot_be_written_is_kept_in_the_users_folder_with_a_word(tmp_path: Path, nowhere: Path) -> None:
    at, said = said_at_start(tmp_path, {"NUMBA_CACHE_DIR": str(nowhere), "XDG_CACHE_HOME": str(tmp_path)})
    assert Path(at).parent == tmp_path / "liquid-study"
    assert Path(at).is_dir()
    assert said == f"{nowhere} cannot be written: compiled code is stored in {tmp_path / 'liquid-study'}\n"


@about_user_cache
def test_where_nothing_can_be_kept_the_program_works_and_says_what_to_do(tmp_path: Path, nowhere: Path) -> None:
    at, said = said_at_start(tmp_path, {"NUMBA_CACHE_DIR": str(nowhere), "XDG_CACHE_HOME": str(nowhere)})
    assert at == "None"
    assert len(said.splitlines()) == 1
    assert "every start compiles again" in said
    assert "NUMBA_CACHE_DIR" in said


@about_user_cache
def test_nobody_hears_of_a_cache_that_works(tmp_path: Path) -> None:
    assert said_at_start(tmp_path, {"NUMBA_CACHE_DIR": "", "XDG_CACHE_HOME": str(tmp_path)})[1] == ""


PACKAGE = Path(__file__).parents[3] / "study_app"
ADDS = """
from study_app.haptics.kernels import compiled, vector
import numpy as np
vector.norm(np.zeros(3))
hits = sum(vector.norm.stats.cache_hits.values())
print(compiled.CACHE, hits)
"""


def started(package: Path, variables: dict[str, str]) -> tuple[Path, int]:
    """Run a copy of the package that computes a length; return its cache and the number of functions found there."""
    environment = os.environ | {"PYTHONPATH": str(package.parent), "PYTHONSAFEPATH": "1"} | variables
    done = subprocess.run(
        [sys.executable, "-c", ADDS], env=environment, capture_output=True, text=True, check=False, cwd=package.parent
    )
    assert done.returncode == 0, done.stderr
    cache, hits = done.stdout.rsplit(maxsplit=1)
    return Path(cache), int(hits)


def copy_of_package(to: Path) -> Path:
    shutil.copytree(PACKAGE, to / "study_app", ignore=shutil.ignore_patterns("__pycache__", "gui", "analysis", "app"))
    return to / "study_app"


@pytest.mark.nightly
@about_compiled_code
def test_a_package_that_moved_finds_what_it_compiled(tmp_path: Path) -> None:
    own = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    first, second = copy_of_package(tmp_path / "a"), copy_of_package(tmp_path / "b")
    made, hits = started(first, own)
    assert hits == 0
    assert started(second, own) == (made, 1)


@pytest.mark.nightly
@about_compiled_code
def test_a_cache_that_came_with_the_program_is_begun_with_unless_it_is_for_another_processor(tmp_path: Path) -> None:
    package = copy_of_package(tmp_path / "a")
    generic = {"NUMBA_CPU_NAME": "generic"}
    made, hits = started(package, generic | {"NUMBA_CACHE_DIR": str(tmp_path / "made")})
    assert hits == 0
    shutil.copytree(made, package / "compiled" / made.name)
    fresh = {"NUMBA_CACHE_DIR": str(tmp_path / "fresh")}
    assert started(package, generic | fresh) == (tmp_path / "fresh" / made.name, 1)
    other = fresh | {"NUMBA_CPU_NAME": "x86-64-v2"}
    assert started(package, other)[1] == 0
    assert started(package, other)[1] == 1
    assert started(package, generic | fresh)[1] == 1


def test_a_shipped_cache_is_copied_once_and_a_torn_copy_is_swept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = tmp_path / "cache" / ("a" * 16)
    shipped = tmp_path / "shipped"
    (shipped / own.name / "haptics").mkdir(parents=True)
    (shipped / own.name / "haptics" / "tick.nbi").write_bytes(b"x")
    monkeypatch.setattr(compiled, "SHIPPED_CACHE", shipped)
    own.parent.mkdir()
    with monkeypatch.context() as disk_full:
        disk_full.setattr(shutil, "copytree", lambda *_a, **_n: (_ for _ in ()).throw(OSError("full")))
        compiled.copy_shipped(own)
    assert list(own.parent.iterdir()) == []
    compiled.copy_shipped(own)
    assert [path.name for path in own.parent.iterdir()] == [own.name]
    (own / "haptics" / "tick.nbi").write_bytes(b"mine")
    compiled.copy_shipped(own)
    assert (own / "haptics" / "tick.nbi").read_bytes() == b"mine"
