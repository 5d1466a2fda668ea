import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba.core.errors import NumbaError

from study_app.haptics.kernels import compiled
from study_app.haptics.kernels.compiled import kernel, part
from tests.haptics.scenes import COMPILED

about_compiled_code = pytest.mark.skipif(not COMPILED, reason="about compiled code")


@pytest.mark.slow
@about_compiled_code
@pytest.mark.parametrize("decorator", [kernel, part])
def test_code_of_the_servo_that_would_allocate_does_not_compile(decorator):
    @decorator
    def make(count):
        return np.zeros(count)[0]

    with pytest.raises((NumbaError, NotImplementedError)):
        make(3)


TWICE = """
from study_app.haptics.kernels import compiled
@compiled.kernel
def twice(x): return 2 * x
assert twice(21) == 42
print(compiled.CACHE)
"""


def said_at_start(folder: Path, environment: dict[str, str], text: str = TWICE, *arguments: str) -> tuple[str, str]:
    """Run a program whose file is in ``folder``; return its output and its log."""
    program = folder / "program.py"
    if not program.exists():  # its cache is that of its time of change
        program.write_text(text, encoding="utf-8", newline="\n")
    process = subprocess.run(
        [sys.executable, str(program), *arguments],
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[3])} | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert process.returncode == 0, process.stderr
    return process.stdout.strip(), process.stderr


STEP = """
import sys
from study_app.haptics.kernels.compiled import kernel, part
@DECORATOR
def half(value): return value / 2
@kernel
def once(value): return 2 * half(value)
@kernel
def twice(value): return 4 * half(value)
def say():
    (code,) = half.overloads.values()
    print(type(code.library).__name__, sum(half.stats.cache_hits.values()), end=";")
caller, factor = {"once": (once, 1), "twice": (twice, 2)}[sys.argv[1]]
assert caller(3.0) == 3.0 * factor
say()
assert half(3.0) == 1.5
assert caller(5.0) == 5.0 * factor
say()
"""


@pytest.mark.slow
@about_compiled_code
@pytest.mark.parametrize("decorator", ["kernel", "part"])
def test_a_step_is_code_for_its_callers_until_python_calls_it_also_from_the_cache(
    decorator: str, tmp_path: Path
) -> None:
    program, cache = STEP.replace("DECORATOR", decorator), {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    for caller, hits in (("once", "00"), ("twice", "12")):
        said, _ = said_at_start(tmp_path, cache, program, caller)
        assert said == f"_StepCode {hits[0]};JITCodeLibrary {hits[1]};"


@pytest.fixture
def nowhere(tmp_path: Path) -> Path:
    """Return a path in which no user can create a folder, since it is a file."""
    file = tmp_path / "file"
    file.write_text("no folder", encoding="utf-8", newline="\n")
    return file / "cache"


about_user_cache = pytest.mark.skipif(sys.platform != "linux", reason="XDG_CACHE_HOME is Linux's")


@pytest.mark.slow
@about_user_cache
def test_a_cache_that_cannot_be_written_is_kept_in_the_users_folder_with_a_word(tmp_path: Path, nowhere: Path) -> None:
    at, said = said_at_start(tmp_path, {"NUMBA_CACHE_DIR": str(nowhere), "XDG_CACHE_HOME": str(tmp_path)})
    assert Path(at).parent == tmp_path / "liquid-study"
    assert Path(at).is_dir()
    assert said == f"{nowhere} cannot be written: compiled code is stored in {tmp_path / 'liquid-study'}\n"


@pytest.mark.slow
@about_user_cache
def test_without_a_writable_cache_the_program_works_and_names_the_remedy(tmp_path: Path, nowhere: Path) -> None:
    at, said = said_at_start(tmp_path, {"NUMBA_CACHE_DIR": str(nowhere), "XDG_CACHE_HOME": str(nowhere)})
    assert at == "None"
    assert len(said.splitlines()) == 1
    assert "every start compiles again" in said
    assert "NUMBA_CACHE_DIR" in said


PACKAGE = Path(__file__).parents[3] / "study_app"
ADDS = """
from study_app.haptics.kernels import compiled, vector
import numpy as np
vector.norm(np.zeros(3))
hits = sum(vector.norm.stats.cache_hits.values())
print(compiled.CACHE, hits)
"""


def started(package: Path, variables: dict[str, str], first: str = "") -> tuple[Path, int]:
    """Run ``first``, then let a copy of the package compute a length; return its cache and its loaded functions."""
    environment = os.environ | {"PYTHONPATH": str(package.parent), "PYTHONSAFEPATH": "1"} | variables
    process = subprocess.run(
        [sys.executable, "-c", first + ADDS],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        cwd=package.parent,
    )
    assert process.returncode == 0, process.stderr
    cache, hits = process.stdout.rsplit(maxsplit=1)
    return Path(cache), int(hits)


def copy_of_package(to: Path) -> Path:
    shutil.copytree(PACKAGE, to / "study_app", ignore=shutil.ignore_patterns("__pycache__", "gui", "analysis", "app"))
    return to / "study_app"


def damage(cache: Path) -> None:
    path = next(cache.rglob("*.nbc"))
    path.write_bytes(path.read_bytes()[:-1] + b"\0")


@pytest.mark.nightly
@about_compiled_code
def test_a_shipped_cache_is_used_only_if_sources_versions_and_processor_fit_and_it_is_undamaged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("NUMBA_CPU_NAME", raising=False)
    package = copy_of_package(tmp_path / "a")
    cache, hits = started(package, {"NUMBA_CPU_NAME": "generic", "NUMBA_CACHE_DIR": str(tmp_path / "made")})
    assert hits == 0
    shipped = package / "compiled" / cache.name
    shutil.copytree(cache, shipped)
    (shipped / compiled.CHECKSUM).write_text(compiled.checksum_of(shipped), encoding="ascii", newline="\n")

    assert started(package, {"NUMBA_CACHE_DIR": str(tmp_path / "fits")}) == (tmp_path / "fits" / cache.name, 1)
    host = {"NUMBA_CACHE_DIR": str(tmp_path / "fits"), "NUMBA_CPU_NAME": "host"}
    assert started(package, host)[1] == 0
    assert started(package, host)[1] == 1
    assert started(package, {"NUMBA_CACHE_DIR": str(tmp_path / "fits")})[1] == 1

    vector = package / "haptics" / "kernels" / "vector.py"
    source = vector.read_bytes()
    vector.write_bytes(source + b"# edited\n")
    assert started(package, {"NUMBA_CACHE_DIR": str(tmp_path / "edited")})[1] == 0
    vector.write_bytes(source)
    older = {"NUMBA_CACHE_DIR": str(tmp_path / "older")}
    assert started(package, older, first="import numba; numba.__version__ = '0.0.1'")[1] == 0
    damage(shipped)
    assert started(package, {"NUMBA_CACHE_DIR": str(tmp_path / "damaged")})[1] == 0


def test_the_digest_depends_on_processor_and_versions() -> None:
    digests = {
        compiled.digest_of(compiled.SOURCES, processor, versions)
        for processor in compiled.PROCESSORS
        for versions in (compiled.versions(), "Python 3.12, numba 0.62.0, llvmlite 0.45.0, x86_64-pc-windows-msvc")
    }
    assert len(digests) == 4


def digest_of(package: Path) -> str:
    return compiled.digest_of(compiled.compiled_sources(package), "generic", "")


def digest_with(package: Path, file: str, old: str, new: str) -> str:
    """Return the digest of the sources after a change of one file, which is then undone."""
    path = package / file
    text = path.read_text(encoding="utf-8")
    assert old in text, (file, old)
    path.write_text(text.replace(old, new, 1), encoding="utf-8", newline="\n")
    digest = digest_of(package)
    path.write_text(text, encoding="utf-8", newline="\n")
    return digest


def test_a_changed_constant_of_a_kernel_changes_the_digest_and_a_word_elsewhere_does_not(tmp_path: Path) -> None:
    package = copy_of_package(tmp_path)
    digest = digest_of(package)
    assert digest == compiled.digest_of(compiled.SOURCES, "generic", "")
    for file, old, new in (
        ("haptics/kernels/safety.py", '"""', '"""The '),  # its own file
        ("haptics/model/layout.py", "LIMITER_NORM = 1 << 3", "LIMITER_NORM = 1 << 13"),  # imported by it
        ("haptics/model/effect.py", "INT, FLOAT", "FLOAT, INT"),  # imported by what it imports
    ):
        assert digest_with(package, file, old, new) != digest, file
    assert digest_with(package, "haptics/model/overrides.py", '"""', '"""The ') == digest
    (package / "haptics/model/effects/unlisted.py").write_text(
        "", encoding="utf-8", newline="\n"
    )  # found by `iter_modules`
    assert digest_of(package) != digest


def compiled_functions(tree: ast.Module) -> list[ast.FunctionDef]:
    return [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
        and {ast.unparse(it).removeprefix("compiled.") for it in node.decorator_list} & {"kernel", "part", "workings"}
    ]


def test_compiled_functions_freeze_only_sources_in_the_digest() -> None:
    """Compiled functions freeze values, also through constants of a module that they read."""
    outside = set()
    for path in PACKAGE.rglob("*.py"):
        name = ".".join(path.relative_to(PACKAGE).with_suffix("").parts)
        tree = ast.parse(path.read_text(encoding="utf-8"))
        if name not in compiled.SOURCES:
            assert not compiled_functions(tree), name
            continue
        frozen = [statement for function in compiled_functions(tree) for statement in function.body]
        frozen += [statement for statement in tree.body if isinstance(statement, ast.Assign | ast.AnnAssign)]
        read = {node.id for each in frozen for node in ast.walk(each) if isinstance(node, ast.Name)}
        for node in ast.walk(tree):
            assert not (isinstance(node, ast.Import) and "study_app" in ast.unparse(node)), f"{name}: import by from"
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("study_app"):
                top = [*str(node.module).split("."), node.names[0].name][1]
                bound = {it.asname or it.name for it in node.names}
                outside |= {f"{name}: {it}" for it in bound & read if top not in compiled.KERNEL_FOLDERS}
    assert outside == {"devices.registry: Registry", "devices.registry: Returns"}, "of plug-ins, not compiled"
