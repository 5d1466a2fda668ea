"""How this package compiles: one decorator, and one cache that is never stale after an edit.

numba keys its on-disk cache on the file of the outermost function alone, so it would miss a change in a function that
it calls, or in a constant that it reads. The cache is therefore a folder named after a digest. The digest covers every
module that compiles a function, what these modules import, the versions of Python, numba and LLVM, and the processor.
Old folders are removed. Within the folder a function is found by its path relative to the package, so that the package
may be moved. A wheel or a bundle comes with filled caches for two kinds of processors (see docs/install.md), and starts
with a copy of the one that fits.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import re
import secrets
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, TypeVar, cast

import llvmlite
import numba
from llvmlite.binding import get_default_triple, get_host_cpu_features, get_host_cpu_name
from llvmlite.binding.newpassmanagers import ModulePassManager, create_new_module_pass_manager
from numba.core import event
from numba.core.caching import FunctionCache, UserProvidedCacheLocator
from numba.core.codegen import CPUCodegen, JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.options import DefaultOptions
from numba.core.registry import CPUDispatcher
from numba.core.sigutils import normalize_signature
from platformdirs import user_cache_path

log = logging.getLogger(__name__)

_PACKAGE = Path(__file__).resolve().parents[2]
KERNEL_FOLDERS = ("haptics", "devices", "evidence")
"""Compiled functions, and all constants that they read, are in these; `tests.haptics.kernels.test_compiled` checks."""
_SHIPPED_CACHES = _PACKAGE / "compiled"
"""Caches that came with the program; only wheels and bundles of one system have them."""
CHECKSUM: Final = "sha256"
"""The file of a shipped cache that holds the digest of its other files."""
_X86_64_V3 = {"x86-64-v3": ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")}
PROCESSORS: Final = (_X86_64_V3 if get_default_triple().startswith("x86_64") else {}) | {"generic": ()}
"""LLVM's names of the processors of shipped caches, the best one first, each with the features that it needs."""

_KEPT_FOLDERS = 8  # caches kept at any age
_UNUSED_S = 86_400.0  # a program that started less than a day ago keeps its cache
_SWEPT_AT_ONCE = 8  # removals per start, which they delay
_COMPILES = (b"compiled import", b"import compiled", b"import numba", b"haptics.kernels import")
_IMPORTS = re.compile(r"from study_app\.([\w.]+) import \(?((?<=\()[^)]*|[^\n]*)")
_DIGEST = re.compile(r"[0-9a-f]{16}")
_HALF_REMOVED = re.compile(r"\.[0-9a-f]{16}\.[0-9a-f]{8}\.gone")

_OPTIONS: dict[str, Any] = {"nopython": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
# numba's private name, which its stubs lack; without the option ticks are slower and equally correct.
_NO_MEMORY: dict[str, Any] = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}
_DEFERS = hasattr(CPUCodegen, "_pass_builder") and hasattr(ModulePassManager, "add_global_dead_code_eliminate_pass")
"""Whether numba is new enough to optimise a step within its callers only; otherwise compiling takes longer."""

_F = TypeVar("_F", bound=Callable[..., Any])


def compiled_sources(package: Path) -> dict[str, bytes]:
    """Return the modules with compiled functions and all that they import within `KERNEL_FOLDERS`, by name."""
    sources = {}
    for top in KERNEL_FOLDERS:
        for folder, _, files in os.walk(package / top):  # several times as fast as Path.rglob, at every start
            within = folder[len(str(package)) + 1 :].replace(os.sep, ".")
            for file in files:
                if file.endswith(".py"):
                    sources[f"{within}.{file[:-3]}"] = Path(folder, file).read_bytes()
    covered: set[str] = set()
    left = {name for name, source in sources.items() if any(call in source for call in _COMPILES)}
    while left:
        covered |= left
        imported: set[str] = set()
        for name in left:
            if b"iter_modules" in sources[name]:  # it imports all modules of its folder
                imported.update(source for source in sources if source.rpartition(".")[0] == name.rpartition(".")[0])
            for module, names in _IMPORTS.findall(sources[name].decode()):
                imported.update((module, *(f"{module}.{member}" for member in names.replace(",", " ").split())))
        imported |= {f"{name}.__init__" for name in imported}
        left = (imported & sources.keys()) - covered
    return {name: sources[name] for name in sorted(covered)}


def versions() -> str:
    """Return the versions that compiled code depends on, and the kind of machine."""
    python = f"{sys.version_info.major}.{sys.version_info.minor}"
    return f"Python {python}, numba {numba.__version__}, llvmlite {llvmlite.__version__}, {get_default_triple()}"


def digest_of(sources: dict[str, bytes], processor: str, versions: str) -> str:
    """Return the name of the cache of these modules, compiled for a processor with these versions."""
    digest = hashlib.sha256(f"{processor} {versions}".encode())
    for name, source in sources.items():
        digest.update(name.encode())
        digest.update(source)
    return digest.hexdigest()[:16]


def checksum_of(cache: Path) -> str:
    """Return the digest of the names and contents of all files of a cache but its checksum."""
    digest = hashlib.sha256()
    for path in sorted(path for path in cache.rglob("*") if path.is_file() and path.name != CHECKSUM):
        digest.update(path.relative_to(cache).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _processor() -> str:
    """Return the processor to compile for: NUMBA_CPU_NAME, or that of a shipped cache which fits, or the one here.

    NUMBA_CPU_NAME=host ignores shipped caches.
    """
    wanted = os.environ.get("NUMBA_CPU_NAME")
    if wanted is None and _SHIPPED_CACHES.is_dir():
        features = get_host_cpu_features()
        for name, needed in PROCESSORS.items():
            is_shipped = (_SHIPPED_CACHES / digest_of(SOURCES, name, versions())).is_dir()
            if is_shipped and all(features.get(feature) for feature in needed):
                vars(numba.config).update(CPU_NAME=name, CPU_FEATURES="")
                return name
    if wanted in (None, "host"):
        vars(numba.config)["CPU_NAME"] = None
        return f"{get_host_cpu_name()} {get_host_cpu_features().flatten()}"
    vars(numba.config)["CPU_FEATURES"] = vars(numba.config)["CPU_FEATURES"] or ""  # by default those of the one here
    return wanted


def _use_own_cache() -> Path | None:
    """Use the first writable folder, and log it if it is not the first choice; return None without one."""
    wanted = [
        *map(Path, filter(None, [os.environ.get("NUMBA_CACHE_DIR")])),
        user_cache_path("liquid-study", appauthor=False, opinion=False),
    ]
    digest = digest_of(SOURCES, _processor(), versions())
    for place in wanted:
        _copy_shipped(place / digest)
        if _writable(place / digest):
            if place is not wanted[0]:
                log.warning("%s cannot be written: compiled code is stored in %s", wanted[0], place)
            vars(numba.config)["CACHE_DIR"] = str(place / digest)
            _sweep_caches(place / digest)
            return place / digest
    places = " and ".join(map(str, wanted))
    log.warning(
        "%s cannot be written: every start compiles again, for up to a minute; set NUMBA_CACHE_DIR to a folder", places
    )
    return None


def _copy_shipped(own: Path) -> None:
    """Copy the shipped cache of this name, if there is one and it is undamaged, to ``own`` unless that exists."""
    shipped = _SHIPPED_CACHES / own.name
    if own.exists() or not shipped.is_dir():
        return
    making = own.with_name(f".{own.name}.{secrets.token_hex(4)}.gone")  # swept later if the program is killed here
    with contextlib.suppress(OSError):
        try:
            shutil.copytree(shipped, making, copy_function=shutil.copyfile)
            if checksum_of(making) != (making / CHECKSUM).read_text(encoding="ascii"):
                log.warning("%s is damaged and is not used: the force model is compiled here", shipped)
                return
            making.rename(own)
        finally:
            shutil.rmtree(making, ignore_errors=True)


def _writable(folder: Path) -> bool:
    """Create a folder and set its modification time to now; return whether it is writable."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


def _sweep_caches(own: Path) -> None:
    """Remove the caches next to ``own`` that no program used for a day, except the newest.

    The modification time of a cache is the last start of a program that uses it. A cache is renamed before it is
    removed, so that two programs that sweep at the same time remove different ones. If a program starts with the cache
    meanwhile, the cache is renamed back, and numba compiles what is missing. What cannot be removed stays.
    """
    with contextlib.suppress(OSError):
        others = [path for path in own.parent.iterdir() if path != own and path.is_dir()]
        for left in (path for path in others if _HALF_REMOVED.fullmatch(path.name)):
            shutil.rmtree(left, ignore_errors=True)
        caches = sorted((path.stat().st_mtime, path) for path in others if _DIGEST.fullmatch(path.name))
        for used_at, path in caches[: max(0, len(caches) + 1 - _KEPT_FOLDERS)][:_SWEPT_AT_ONCE]:
            if time.time() - used_at > _UNUSED_S:
                _remove_cache(path, used_at)


def _remove_cache(path: Path, used_at: float) -> None:
    """Remove a cache, unless a program has started with it since ``used_at`` [s since 1970]."""
    gone = path.with_name(f".{path.name}.{secrets.token_hex(4)}.gone")
    with contextlib.suppress(OSError):
        path.rename(gone)
        if gone.stat().st_mtime != used_at:
            gone.rename(path)
        else:
            shutil.rmtree(gone)


SOURCES = compiled_sources(_PACKAGE)
CACHE: Path | None = _use_own_cache()
"""The folder of compiled code; None if no folder is writable."""


class PackageCacheLocator(UserProvidedCacheLocator):
    """Locate compiled functions of this package by the sources' digest and their path in the package.

    numba would look under the absolute path of their file, and in a frozen program under the bytes of its executable.
    """

    def __init__(self, py_func: Callable[..., Any], py_file: str) -> None:
        super().__init__(py_func, py_file)  # type: ignore[no-untyped-call]
        self._cache_path = str(Path(str(CACHE), *Path(py_file).resolve().relative_to(_PACKAGE).parent.parts))

    def get_source_stamp(self) -> str:
        return Path(str(CACHE)).name

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> PackageCacheLocator | None:
        """Return the locator of a function, or None where its file is not covered by the digest."""
        file = Path(py_file).resolve()
        if (
            not file.is_relative_to(_PACKAGE)
            or ".".join(file.relative_to(_PACKAGE).with_suffix("").parts) not in SOURCES
        ):
            return None
        locator = super().from_function(py_func, py_file)  # type: ignore[no-untyped-call]
        return cast("PackageCacheLocator | None", locator)


if CACHE is not None:  # numba before 0.61.1 ignores it, and compiles again after the package is moved
    _LOCATORS = (f"{__name__}.{PackageCacheLocator.__name__}", "UserProvidedCacheLocator", "IPythonCacheLocator")
    vars(numba.config)["CACHE_LOCATOR_CLASSES"] = ",".join(_LOCATORS)


class _StepCode(JITCodeLibrary):
    """Code that is optimised and translated only within the functions that call it."""

    _codegen: Any

    def _optimize_final_module(self) -> None:
        if not _DEFERS:
            super()._optimize_final_module()  # type: ignore[no-untyped-call]
            return
        removal = create_new_module_pass_manager()  # of addresses of this process, which are not used
        removal.add_global_dead_code_eliminate_pass()
        removal.run(self._final_module, self._codegen._pass_builder())  # noqa: SLF001 - numba has no public way to it

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()  # type: ignore[no-untyped-call]
        self._finalized = True

    def get_pointer_to_function(self, _name: str) -> int:
        """Return 0: Python does not call it."""
        self._ensure_finalized()  # type: ignore[no-untyped-call]
        return 0

    def serialize_using_object_code(self) -> Any:
        """Return bitcode for the cache: this code is never translated on its own."""
        return self.serialize_using_bitcode()  # type: ignore[no-untyped-call]

    @property
    def codegen(self) -> Any:
        """The object whose `set_env` numba calls."""
        return self

    def set_env(self, _name: str, _environment: Any) -> None:
        """Do nothing: only Python objects are found through the environment."""


class _StepCompiler(Compiler):
    def define_pipelines(self) -> Any:
        """Compile into a `_StepCode`."""
        self.state.library = _StepCode(self.state.targetctx.codegen(), self.state.func_id.func_qualname)  # type: ignore[no-untyped-call]
        return super().define_pipelines()  # type: ignore[no-untyped-call]


class _Cache(FunctionCache):
    of_step = False

    def _index_key(self, *of: Any) -> Any:
        return (*super()._index_key(*of), self.of_step)  # type: ignore[no-untyped-call]

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load code as it was compiled: a step for its callers only."""
        codegen = target_context.codegen()
        library = codegen._library_class  # noqa: SLF001 - numba has no public way to it
        codegen._library_class = _StepCode if self.of_step else library  # noqa: SLF001
        try:
            return super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        finally:
            codegen._library_class = library  # noqa: SLF001


class _Kernel(CPUDispatcher):
    """A compiled function; its interface for Python is compiled only if Python calls it."""

    _cache: Any  # where nothing can be kept, numba's own without ``of_step``
    _compiler: Any
    _of_step = False

    def enable_caching(self) -> None:
        """Use the cache on disk."""
        self._cache = _Cache(self.py_func)  # type: ignore[no-untyped-call]

    def _choose(self, of_step: bool) -> None:
        self._of_step = self._cache.of_step = of_step
        self.targetoptions["no_cpython_wrapper"] = of_step
        self._compiler.pipeline_class = _StepCompiler if of_step else Compiler

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Compile the function for a compiled caller."""
        with global_compiler_lock:
            before = self._of_step
            self._choose(True)
            try:
                return super().get_call_template(args, kws)
            finally:
                self._choose(before)

    def compile(self, sig: Any) -> Any:
        """Compile the function for Python, again if it was compiled only for compiled callers."""
        with global_compiler_lock:
            arguments = tuple(normalize_signature(sig)[0])  # type: ignore[no-untyped-call]
            if not self._of_step and arguments in self.overloads and not _is_callable(self.overloads[arguments]):
                del self.overloads[arguments]
            return super().compile(sig)

    def add_overload(self, cres: Any) -> None:
        """Make a specialisation available to Python if it can be called from there."""
        if _is_callable(cres):
            super().add_overload(cres)
        else:
            self.overloads[tuple(cres.signature.args)] = cres


def _is_callable(compiled: Any) -> bool:
    """Return whether Python can call a compiled function."""
    return bool(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_cpython_wrapper_name))


def _compiled(function: _F, **options: Any) -> _F:
    if vars(numba.config)["DISABLE_JIT"]:
        return function
    dispatcher = _Kernel(function, targetoptions=_OPTIONS | options)
    if CACHE is not None:
        dispatcher.enable_caching()
    return cast(_F, dispatcher)


def kernel(function: _F) -> _F:
    """Compile ``function`` for the servo: no interpreter lock, IEEE arithmetic, division by zero gives infinity.

    numba's memory management is off: code that would allocate does not compile, and arrays passed on are not
    reference-counted, which took two thirds of a tick. The Python caller keeps the arrays alive.
    """
    return _compiled(function, **_NO_MEMORY)


def part(function: _F) -> _F:
    """Compile ``function`` inline into each kernel that calls it: for the steps of a tick, which pass whole models."""
    return _compiled(function, **_NO_MEMORY, forceinline=True)


def evidence_kernel(function: _F) -> _F:
    """Compile ``function`` for evidence, not for the servo: like `kernel`, but it may allocate arrays."""
    return _compiled(function)


def entry_of(function: _F, *arguments: Any) -> _F:
    """Return the specialisation of a compiled function for these types, which calls do not look up again.

    The lookup takes 30 µs for records, as long as ten ticks. Calls with other types are undefined.
    """
    dispatcher: Any = function
    if not hasattr(dispatcher, "overloads"):  # not compiled: NUMBA_DISABLE_JIT
        return function
    return cast(_F, dispatcher.compile(tuple(map(dispatcher.typeof_pyval, arguments))))


EXPECTED: Final = 194
"""Approximate number of functions that a first session compiles; a test compares it with a device and its servo."""


class _Counter(event.Listener):
    """Counts compiled functions, including nested compilations."""

    def __init__(self, progress: Callable[[float], object]) -> None:
        self._progress = progress
        self.compiled = 0

    def on_start(self, event: Any) -> None:
        """Do nothing: a function that starts to compile does not count yet."""

    def on_end(self, event: Any) -> None:
        self.compiled += 1
        self._progress(min(0.99, self.compiled / EXPECTED))


@contextmanager
def following_compilation(progress: Callable[[float], object]) -> Iterator[_Counter]:
    """Report the fraction done (0 to 1) to ``progress`` after each function compiled within the block."""
    counter = _Counter(progress)
    with event.install_listener("numba:compile", counter):
        yield counter
