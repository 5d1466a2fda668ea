"""What has a descriptor, by name: the program's own, and plug-ins at the entry points of other packages.

A package adds a device, a question, a task, a method, a finding or an outlet by an entry point of the group
``liquid_study.devices``, ``liquid_study.questions`` …: docs/plug-ins.md. A plug-in that fails hides no other.
"""

from __future__ import annotations

import importlib
import pkgutil
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from functools import cache, wraps
from importlib.metadata import EntryPoint, entry_points
from inspect import getattr_static
from numbers import Real
from types import ModuleType
from typing import Any, Final, Generic, Literal, NamedTuple, TypeVar, cast

from study_app.errors import PlugInError, StudyError

_T = TypeVar("_T")

REGISTRIES: Final = {
    "device": "study_app.devices.registry:DEVICES",
    "question": "study_app.protocol.questions:KINDS",
    "task": "study_app.protocol.trials.tasks:TASK_KINDS",
    "method": "study_app.protocol.trials.methods:METHOD_KINDS",
    "finding": "study_app.analysis.findings:FINDINGS",
    "outlet": "study_app.outlets.session_outlets:SINKS",
}
"""Where each kind has its registry, which is imported when it is asked for."""


def modules_of(package: ModuleType) -> Iterator[ModuleType]:
    """Yield the modules of a package, imported, by name."""
    for module in sorted(pkgutil.iter_modules(package.__path__), key=lambda module: module.name):
        yield importlib.import_module(f"{package.__name__}.{module.name}")


def by_name(own: Mapping[str, _T], name: str) -> _T:
    """Return the object that a descriptor names: one of the program's own by id, or that at ``module:attribute``."""
    return cast("_T", pkgutil.resolve_name(name)) if ":" in name else own[name]


@dataclass(frozen=True, slots=True)
class PlugIn:
    """The contribution of one entry point.

    ``kind`` is one of `REGISTRIES`, ``package`` the distribution, ``origin`` its location; ``fault`` is a line on why
    it cannot be used, "" if it can.
    """

    kind: str
    name: str
    _: KW_ONLY
    package: str
    version: str
    origin: str
    fault: str = ""

    @property
    def described(self) -> dict[str, str]:
        """The record for a receipt."""
        return {"kind": self.kind, "name": self.name, "package": self.package, "version": self.version}


@cache
def _points() -> tuple[EntryPoint, ...]:
    """Return the entry points of all groups; cached, since reading takes 10 to 30 ms."""
    groups = entry_points()
    return tuple(point for kind in REGISTRIES for point in groups.select(group=f"liquid_study.{kind}s"))


def _of_kind(kind: str) -> Iterator[tuple[EntryPoint, PlugIn]]:
    """Yield the entry points of a kind with the metadata of their packages."""
    for point in _points():
        if point.group == f"liquid_study.{kind}s" and (dist := point.dist) is not None:
            yield (
                point,
                PlugIn(kind, point.name, package=dist.name, version=dist.version, origin=str(dist.locate_file(""))),
            )


class Returns(NamedTuple):
    """The permitted results of a plug-in's function or property: a phrase, and the test of a value."""

    permitted: str
    holds: Callable[[Any], bool]


def number_between(low: float, high: float) -> Returns:
    """Return a permission for numbers from ``low`` to ``high``, which excludes NaN."""
    return Returns(
        f"a number from {low:g} to {high:g}", lambda value: isinstance(value, Real) and low <= float(value) <= high
    )


def instance_of(kind: type) -> Returns:
    """Return a permission for instances of a class."""
    return Returns(f"an instance of {kind.__name__}", lambda value: isinstance(value, kind))


def are_numbers(values: Any) -> bool:
    """Return whether ``values`` is a sequence of finite numbers."""
    return isinstance(values, Sequence) and all(
        isinstance(value, Real) and abs(float(value)) < 1e12 for value in values
    )


class Registry(Mapping[str, _T], Generic[_T]):
    """The descriptors of one kind, by name: the program's ``own``, then those of plug-ins.

    Entry points are read when a name is not among its own, or when all are requested. An entry point holds an instance
    of the class ``base``, with its ``name``, or a subclass whose name is the value of its attribute or field ``key``.
    Names in study files, those of a ``kind``, begin with the package, ``package:name``, so that a file states what to
    install.

    ``returns`` are the functions and properties of a plug-in that the program calls, with their permitted results:
    another value, or an error, is a `PlugInError` that names the plug-in.
    """

    def __init__(
        self,
        kind: str,
        own: Mapping[str, _T],
        base: type,
        key: Literal["name", "key", "kind"],
        returns: Mapping[str, Returns],
    ) -> None:
        self.kind, self.own = kind, own
        self._base, self._key, self._returns = base, key, returns
        self._found: tuple[tuple[PlugIn, ...], Mapping[str, _T]] | None = None

    @property
    def plug_ins(self) -> tuple[PlugIn, ...]:
        """All plug-ins of this kind, including unusable ones."""
        return self._read()[0]

    @property
    def others(self) -> Mapping[str, _T]:
        """The descriptors of plug-ins only."""
        return self._read()[1]

    def plug_in(self, name: str) -> PlugIn | None:
        """Return the plug-in that defines a name; None if it is the program's own, or unknown."""
        found = () if name in self.own else self.plug_ins
        return next((plug_in for plug_in in found if plug_in.name == name and not plug_in.fault), None)

    def missing(self, name: str) -> tuple[str, str]:
        """Return why the name of a plug-in is missing, and the remedy."""
        package = name.partition(":")[0]
        versions = [point.dist.version for point in _points() if point.dist and _canonical(point.dist.name) == package]
        if not versions:
            words = f'"{name}" is a {self.kind} from the plug-in {package}, which is not installed'
            return words, f"pip install {package}"
        faults = [
            plug_in.fault for plug_in in self.plug_ins if plug_in.fault and _canonical(plug_in.package) == package
        ]
        words = f'"{name}" is a {self.kind} that the plug-in {package} {versions[0]} does not provide'
        return ": ".join([words, *faults]), UPDATE

    def __getitem__(self, name: str) -> _T:
        return self.own[name] if name in self.own else self.others[name]

    def __iter__(self) -> Iterator[str]:
        return iter((*self.own, *self.others))

    def __len__(self) -> int:
        return len(self.own) + len(self.others)

    def _read(self) -> tuple[tuple[PlugIn, ...], Mapping[str, _T]]:
        """Load the entry points once; a problem with one is stored as its fault."""
        if self._found is None:
            plug_ins, others = [], dict[str, _T]()
            for point, plug_in in _of_kind(self.kind):
                try:
                    loaded = point.load()
                    name = self._name_of(loaded, point.value, plug_in.package, others)
                    loaded = self._checked(loaded, replace(plug_in, name=name))
                except (Exception, SystemExit, KeyboardInterrupt) as error:  # noqa: BLE001 - code of another package
                    plug_ins.append(replace(plug_in, fault=_line(error)))
                else:
                    plug_ins.append(replace(plug_in, name=name))
                    others[name] = loaded
            self._found = tuple(plug_ins), others
        return self._found

    def _name_of(self, found: Any, place: str, package: str, others: Mapping[str, _T]) -> str:
        """Return the name of an entry point's object; raise a StudyError with the reason if it has none."""
        if self._key == "name" and not isinstance(found, self._base):
            raise StudyError(f"{place} must be a {self._base.__name__}, but has the type {type(found).__name__}")
        if self._key != "name" and not (isinstance(found, type) and issubclass(found, self._base)):
            raise StudyError(f"{place} is not a subclass of {self._base.__name__}")
        if self._key != "name" and (lacking := getattr(found, "__abstractmethods__", None)):
            raise StudyError(f"{place} lacks {', '.join(sorted(lacking))}: define them")
        name, begins = getattr(found, self._key, ""), f"{_canonical(package)}:"
        if self._key == "kind":
            found.model_json_schema()  # missing keys are reported now rather than by a form
            kind = found.model_fields.get("kind")
            if kind is not None and kind.is_required():
                raise StudyError("its kind does not have a default: set the default to the value of the Literal")
            name = "" if kind is None else kind.default
            if not re.fullmatch(rf"{begins}[a-z][a-z0-9_]*", str(name)):
                raise StudyError(
                    f"its kind is {name!r}: use '{begins}' followed by lowercase letters, digits or underscores"
                )
        if not isinstance(name, str) or not name:
            raise StudyError(f"{place} does not have {self._key}: add it")
        if name in self.own or name in others:
            raise StudyError(f"{self.kind} '{name}' already exists: rename it")
        return name

    def _checked(self, found: Any, plug_in: PlugIn) -> Any:
        """Return a plug-in whose functions and properties return what ``returns`` permits, or raise an error."""

        def check(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
            return _checked_function(function, plug_in, name, self._returns[name])

        if not isinstance(found, type):
            values = {name: getattr(found, name) for name in self._returns}
            return replace(found, **{name: check(name, value) for name, value in values.items() if callable(value)})
        for name, returns in self._returns.items():
            holder = next(kind for kind in (*found.__mro__, object) if name in vars(kind) or kind is object)
            value = getattr_static(found, name, None)
            if holder is object or holder.__module__.startswith("study_app."):
                continue  # inherited
            if isinstance(value, property):
                setattr(found, name, property(check(name, cast("Callable[..., Any]", value.fget))))
            elif isinstance(value, classmethod | staticmethod):
                setattr(found, name, type(value)(check(name, value.__func__)))
            elif callable(value):
                setattr(found, name, check(name, value))
            elif not _holds(returns, value):
                raise StudyError(f"{name} is {_shown(value)}, not {returns.permitted}")
        return found

    def forget(self) -> None:
        """Clear the cache, so that plug-ins are searched for again."""
        self._found = None
        _points.cache_clear()


def _canonical(package: str) -> str:
    """Return the normalised name of a distribution."""
    return re.sub(r"[-_.]+", "-", package).lower()


UPDATE: Final = "update or uninstall the plug-in"


def _line(error: BaseException) -> str:
    """Return an error as one line."""
    words = " ".join(str(error).split())
    kind = "" if isinstance(error, StudyError) else type(error).__name__
    return ": ".join(filter(None, (kind, words)))


def registry(kind: str) -> Registry[Any]:
    """Return the registry of a kind of `REGISTRIES`, imported now."""
    found: Registry[Any] = pkgutil.resolve_name(REGISTRIES[kind])
    return found


def plug_ins() -> tuple[PlugIn, ...]:
    """Return all plug-ins of all kinds, including unusable ones."""
    found: list[PlugIn] = []
    for kind in REGISTRIES:
        named = [plug_in for _, plug_in in _of_kind(kind)]
        try:
            found += registry(kind).plug_ins if named else ()
        except ModuleNotFoundError as error:  # the extra for the analysis is not installed
            found += [replace(plug_in, fault=_line(error)) for plug_in in named]
    return tuple(found)


def _checked_function(function: Callable[..., Any], plug_in: PlugIn, name: str, returns: Returns) -> Callable[..., Any]:
    """Return a plug-in's function whose errors and invalid values are reported as those of the plug-in."""

    @wraps(function)
    def call(*values: Any, **named: Any) -> Any:
        try:
            value = function(*values, **named)
        except StudyError:
            raise
        except (Exception, SystemExit) as error:
            raise _failure(plug_in.package, plug_in.version, _line(error)) from error
        if not _holds(returns, value):
            words = f"{name} of {plug_in.kind} {plug_in.name} returned {_shown(value)}, not {returns.permitted}"
            raise _failure(plug_in.package, plug_in.version, words)
        return value

    return call


def _holds(returns: Returns, value: object) -> bool:
    try:
        return bool(returns.holds(value))
    except Exception:  # noqa: BLE001 - a value of another package
        return False


def _shown(value: object) -> str:
    """Return a value for a message, in at most 40 characters."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 40 else f"{text[:39]}…"


def _failure(package: str, version: str, words: str) -> PlugInError:
    return PlugInError(f"the plug-in {package} {version} failed ({words}): {UPDATE}")


def explain_error(error: BaseException) -> BaseException:
    """Return a `PlugInError` for an error raised in a plug-in, else the error itself."""
    if isinstance(error, StudyError):
        return error
    modules, trace = [], error.__traceback__
    while trace is not None:
        modules.append(str(trace.tb_frame.f_globals.get("__name__", "")).partition(".")[0])
        trace = trace.tb_next
    packages = {re.split(r"\W", point.value)[0]: point.dist for point in _points()}
    dist = next((packages[module] for module in reversed(modules) if packages.get(module) is not None), None)
    if dist is None:
        return error
    return _failure(dist.name, dist.version, _line(error))
