"""Values of one type are passed by name: a syntax-tree check of the whole program.

The rules, for what this program defines:

1. A dataclass with three or more fields of one type takes them as keywords (``kw_only`` or ``KW_ONLY``).
2. A NamedTuple takes at most two values of one type by position.
3. No class is constructed from an unpacked tuple, ``Name(*values)``, unless it takes any number of values there.
4. A function that returns three or more numbers, or arrays of one type, returns a NamedTuple.

A vector or a colour is one value, whose type has a name (``Vector``, ``Point``): rule 4 reads tuples that are written
out. Compiled functions are exempt: numba unpacks their scalars where they are called.
"""

import ast
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import pytest

import study_app

COMPILED = {"kernel", "part", "workings", "njit", "cfunc", "intrinsic", "overload"}
NUMBERS = {"int", "float"}
ARRAYS = {"Array", "Floats", "NDArray"}
FEW = 2
"""So many values of one type may be passed by position."""

Name = tuple[str, str]
"""Module and class."""


@dataclass
class Record:
    """A class and its positional fields: name to type, those of its bases first."""

    kind: str
    bases: list[Name]
    fields: dict[str, str] = field(default_factory=dict)
    takes_any_number: bool = False


@dataclass
class Module:
    """A module's syntax tree, and what its names mean."""

    name: str
    path: str
    tree: ast.Module
    meanings: dict[str, Name] = field(default_factory=dict)

    def class_of(self, node: ast.expr) -> Name | None:
        """Return the class that an expression names, if this program may define it."""
        if isinstance(node, ast.Subscript):
            node = node.value
        if isinstance(node, ast.Name):
            return self.meanings.get(node.id)
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in self.meanings:
            package, module = self.meanings[node.value.id]
            return f"{package}.{module}".lstrip("."), node.attr
        return None


def called(decorator: ast.expr) -> str:
    """Return the last part of a decorator's name."""
    target = decorator.func if isinstance(decorator, ast.Call) else decorator
    return target.attr if isinstance(target, ast.Attribute) else getattr(target, "id", "")


def modules_of(sources: Mapping[str, str]) -> dict[str, Module]:
    """Return the modules, by their names, from their sources by path."""
    modules = {}
    for path, source in sources.items():
        name = path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
        module = Module(name, path, ast.parse(source))
        for node in ast.walk(module.tree):
            if isinstance(node, ast.ImportFrom):
                module.meanings |= {each.asname or each.name: (node.module or "", each.name) for each in node.names}
            elif isinstance(node, ast.Import):
                module.meanings |= {each.asname: ("", each.name) for each in node.names if each.asname}
            elif isinstance(node, ast.ClassDef):
                module.meanings[node.name] = (name, node.name)
        for node in ast.walk(module.tree):
            if isinstance(node, ast.Assign) and (meant := module.class_of(node.value)) is not None:
                module.meanings |= {each.id: meant for each in node.targets if isinstance(each, ast.Name)}
        modules[name] = module
    return modules


def records_of(modules: Mapping[str, Module]) -> dict[Name, Record]:
    """Return the classes of the program."""
    records = {}
    for module in modules.values():
        for node in ast.walk(module.tree):
            if isinstance(node, ast.ClassDef):
                bases = [named for base in node.bases if (named := module.class_of(base)) is not None]
                any_number = any(
                    isinstance(line, ast.FunctionDef) and line.name == "__init__" and line.args.vararg is not None
                    for line in node.body
                )
                records[module.name, node.name] = Record(_kind(node), bases, _positional_fields(node), any_number)
    return records


def _kind(node: ast.ClassDef) -> str:
    if "NamedTuple" in {getattr(base, "id", getattr(base, "attr", "")) for base in node.bases}:
        return "NamedTuple"
    return "dataclass" if "dataclass" in map(called, node.decorator_list) else "class"


def _positional_fields(node: ast.ClassDef) -> dict[str, str]:
    """Return the fields of a record that its constructor takes by position."""
    calls = [each for each in node.decorator_list if isinstance(each, ast.Call)]
    if _kind(node) == "class" or any(each.arg in {"kw_only", "init"} for call in calls for each in call.keywords):
        return {}
    fields = {}
    for line in node.body:
        if not isinstance(line, ast.AnnAssign) or not isinstance(line.target, ast.Name):
            continue
        kind = ast.unparse(line.annotation).strip("'\"").removesuffix(" | None")
        if kind.endswith("KW_ONLY"):
            break
        settings = line.value.keywords if isinstance(line.value, ast.Call) else []
        if not kind.startswith("ClassVar") and not any(each.arg in {"init", "kw_only"} for each in settings):
            fields[line.target.id] = kind
    return fields


def fields_of(name: Name, records: Mapping[Name, Record]) -> dict[str, str]:
    """Return the positional fields of a record and of its bases, which come first."""
    if name not in records:
        return {}
    fields = {}
    for base in reversed(records[name].bases):
        fields |= fields_of(base, records)
    return fields | records[name].fields


def has_many_of_a_type(kinds: Iterable[str]) -> bool:
    return max(Counter(kinds).values(), default=0) > FEW


def faults_of(sources: Mapping[str, str]) -> list[str]:
    """Return where the sources, by path, break a rule."""
    modules = modules_of(sources)
    records = records_of(modules)
    return [
        f"{module.path}:{line}: {what}"
        for module in modules.values()
        for line, what in sorted(_faults(module, module.tree, records))
    ]


def _faults(module: Module, node: ast.AST, records: Mapping[Name, Record]) -> Iterator[tuple[int, str]]:
    """Yield the faults in a part of a module, not those in compiled functions."""
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        if COMPILED & set(map(called, node.decorator_list)):
            return
        if node.returns is not None and (values := _values_by_position(node.returns)):
            yield node.lineno, f"{node.name} returns {values}: return a NamedTuple"
    elif isinstance(node, ast.ClassDef):
        record, fields = records[module.name, node.name], fields_of((module.name, node.name), records)
        if record.kind == "dataclass" and record.fields and has_many_of_a_type(fields.values()):
            yield node.lineno, f"{node.name} has more than {FEW} fields of one type: make it keyword-only"
    elif isinstance(node, ast.Call):
        name_called = module.class_of(node.func)
        if name_called in records:
            if any(isinstance(each, ast.Starred) for each in node.args) and not records[name_called].takes_any_number:
                yield node.lineno, f"{name_called[1]} is constructed from an unpacked tuple: name the values"
            elif has_many_of_a_type(list(fields_of(name_called, records).values())[: len(node.args)]):
                yield node.lineno, f"{name_called[1]} takes more than {FEW} values of one type by position: name them"
    for child in ast.iter_child_nodes(node):
        yield from _faults(module, child, records)


def _values_by_position(annotation: ast.expr) -> str:
    """Return the tuple of many numbers, or arrays of one type, that an annotation contains; none: nothing."""
    if isinstance(annotation, ast.Constant) and isinstance(annotation.value, str):
        annotation = ast.parse(annotation.value, mode="eval").body
    for node in ast.walk(annotation):
        if isinstance(node, ast.Subscript) and ast.unparse(node.value) == "tuple" and isinstance(node.slice, ast.Tuple):
            kinds = Counter(ast.unparse(each).removesuffix(" | None") for each in node.slice.elts)
            numbers = sum(count for kind, count in kinds.items() if kind in NUMBERS)
            arrays = max((count for kind, count in kinds.items() if kind.partition("[")[0] in ARRAYS), default=0)
            if max(numbers, arrays) > FEW:
                return ast.unparse(node)
    return ""


def test_values_of_one_type_are_passed_by_name() -> None:
    folder = Path(study_app.__file__).parent
    sources = {
        path.relative_to(folder.parent).as_posix(): path.read_text(encoding="utf-8")
        for path in sorted(folder.rglob("*.py"))
    }
    assert len(sources) > 300
    assert faults_of(sources) == []


SHAPES = """
from dataclasses import KW_ONLY, dataclass, field
from typing import NamedTuple

from numba import njit


@dataclass(frozen=True, kw_only=True)
class Sphere:
    x_m: float
    y_m: float
    z_m: float


@dataclass
class Pair:
    low: float
    high: float | None
    name: str


@dataclass
class Curve:
    first: float
    last: float
    _: KW_ONLY
    middle: float
    area: float = field(default=0.0)


class Quartiles(NamedTuple):
    q1: float
    median: float
    q3: float


class Labels:
    def __init__(self, *words: str) -> None: ...


Vector = tuple[float, float, float]


def position_m() -> Vector: ...


@njit
def compiled() -> tuple[float, float, float]: ...
"""
"""What keeps to the rules, and what the faulty modules below use."""


@pytest.mark.parametrize(
    ("faulty", "what"),
    [
        (
            "@dataclass\nclass Wide:\n    a: float\n    b: 'float | None'\n    c: float = 0.0",
            "Wide has more than 2 fields",
        ),
        ("@dataclass\nclass Wider(shapes.Pair):\n    third: float", "Wider has more than 2 fields"),
        ("Quartiles(1.0, 2.0, 3.0)", "Quartiles takes more than 2 values"),
        ("Quartiles(*found)", "Quartiles is constructed from an unpacked tuple"),
        ("Q = Quartiles; Q(1.0, 2.0, 3.0)", "Quartiles takes more than 2 values"),
        ("shapes.Pair(*found, name='a')", "Pair is constructed from an unpacked tuple"),
        ("def ends() -> tuple[int, float, float]: ...", "ends returns tuple[int, float, float]"),
        ("def ends() -> 'list[tuple[float, float | None, float]] | None': ...", "ends returns"),
        ("def parts() -> tuple[NDArray[A], NDArray[A], NDArray[A]]: ...", "parts returns"),
    ],
)
def test_each_rule_finds_its_violation_in_another_module(faulty: str, what: str) -> None:
    imports = "from dataclasses import dataclass\nfrom app import shapes\nfrom app.shapes import Quartiles\n"
    (fault,) = faults_of({"app/shapes.py": SHAPES, "app/faulty.py": imports + faulty})
    place, _, said = fault.partition(": ")
    assert place.startswith("app/faulty.py:")
    assert said.startswith(what)


def test_conforming_code_has_no_fault() -> None:
    uses = (
        "from app.shapes import Curve, Labels, Pair, Quartiles, Sphere",
        "Curve(1.0, 2.0, middle=1.5)",
        "Labels(*words)",
        "Pair(1.0, 2.0, 'a')",
        "Quartiles(1.0, 2.0, q3=3.0)",
        "Sphere(**found)",
        "def shape() -> tuple[int, ...]: ...",
        "def named() -> tuple[str, str, str]: ...",
    )
    assert faults_of({"app/shapes.py": SHAPES, "app/uses.py": "\n".join(uses)}) == []
