"""The files for people who join or cite the project name what exists, and agree with the package."""

import ast
import re
import shutil
import subprocess
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from study_app import __version__

yaml = pytest.importorskip("yaml", reason="PyYAML is not installed")

ROOT = Path(__file__).resolve().parents[2]
DECISIONS = sorted((ROOT / "docs" / "decisions").glob("*.md"))
PAGES = [ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", ROOT / "docs" / "install.md", *DECISIONS]
FOLDERS = ("study_app/", "tests/", "docs/", "protocols/", "packaging/", ".ci/", ".github/", "results/")


def named(text: str) -> Iterator[str]:
    """Yield the paths in a text that must exist: those in backticks and those that links lead to."""
    for path in re.findall(r"`([^`\s]+)`", text):
        if path.startswith(FOLDERS) and "NAME" not in path:
            yield path
    for _, path in re.findall(r"\[([^\]]+)\]\((?!https?:)([^)#]+)", text):
        yield path


def read_yaml(path: Path) -> Any:
    return yaml.safe_load(path.read_text("utf-8"))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_path_that_a_page_names_exists(page: Path) -> None:
    text = page.read_text("utf-8")
    missing = [path for path in named(text) if not ((page.parent / path).exists() or (ROOT / path).exists())]
    assert missing == []


def test_changelog_and_citation_name_the_version_of_the_package() -> None:
    log = (ROOT / "CHANGELOG.md").read_text("utf-8")
    releases = re.findall(r"^## \[(\d+\.\d+\.\d+)\] - (\d{4}-\d\d-\d\d)$", log, re.MULTILINE)
    citation = read_yaml(ROOT / "CITATION.cff")
    assert releases[0] == (__version__, citation["date-released"])
    assert citation["version"] == __version__
    assert releases == sorted(releases, reverse=True)
    kinds = set(re.findall(r"^### (.+)$", log, re.MULTILINE))
    assert kinds <= {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}


def test_decisions_are_numbered_and_have_their_parts() -> None:
    assert [int(path.name[:4]) for path in DECISIONS] == list(range(1, len(DECISIONS) + 1))
    for number, path in enumerate(DECISIONS, start=1):
        lines = path.read_text("utf-8").splitlines()
        assert lines[0].startswith(f"# {number}. "), path.name
        assert re.fullmatch(r"Date: \d{4}-\d\d-\d\d\. Status: (accepted|superseded by \d{4})\.", lines[2]), path.name
        assert [line for line in lines if line.startswith("## ")] == ["## Context", "## Decision", "## Consequences"]


def test_the_matrix_is_the_supported_pythons_on_three_systems() -> None:
    matrix = read_yaml(ROOT / ".github" / "workflows" / "check.yml")["jobs"]["tests"]["strategy"]["matrix"]
    with (ROOT / "pyproject.toml").open("rb") as file:
        known = tomllib.load(file)["project"]["classifiers"]
    assert matrix["python"] == [line.rpartition(" ")[2] for line in known if "Python :: 3." in line]
    assert [system.split("-")[0] for system in matrix["system"]] == ["ubuntu", "windows", "macos"]


def test_pre_commit_runs_the_linters_of_the_check() -> None:
    entries = [hook["entry"] for hook in read_yaml(ROOT / ".pre-commit-config.yaml")["repos"][0]["hooks"]]
    check = (ROOT / ".ci" / "run").read_text("utf-8")
    for entry in entries:
        assert f".venv/bin/{entry.split(' --')[0]}" in check


def test_recordings_stay_few_enough_to_be_read() -> None:
    kept = [path for path in (ROOT / "tests").rglob("*") if "golden" in str(path.relative_to(ROOT))]
    texts = (path for path in kept if path.suffix in {".txt", ".json", ".html", ".csv"})
    lines = {path: path.read_bytes().count(b"\n") for path in texts}
    largest = [path.relative_to(ROOT).as_posix() for path in sorted(lines, key=lambda path: -lines[path])[:10]]
    assert 1_000 < sum(lines.values()) <= 15_000, f"docs/testing.md says what is kept; the largest are {largest}"


def test_every_test_of_the_list_of_circles_exists() -> None:
    missing = []
    for line in (ROOT / "tests" / "circles.txt").read_text("utf-8").splitlines():
        module, _, test = line.partition(" ")[2].partition("::")
        function = test.partition("[")[0].rpartition("::")[2]
        if not (ROOT / module).is_file() or f"def {function}" not in (ROOT / module).read_text("utf-8"):
            missing.append(line)
    assert missing == []


def text_without_form(call: ast.Call) -> bool:
    """Return whether a call reads or writes text in the system's own encoding, or writes the system's line ends."""
    if not isinstance(call.func, ast.Attribute):
        return False
    name, keywords = call.func.attr, {keyword.arg for keyword in call.keywords}
    if name == "open":
        mode = call.args[0].value if call.args and isinstance(call.args[0], ast.Constant) else ""
        is_text = isinstance(mode, str) and re.fullmatch(r"[rwax]\+?t?", mode) is not None
        return is_text and not {"encoding", "newline"} <= keywords
    if name == "write_text" and len(call.args) == 1:  # with several arguments it is another function
        return not {"encoding", "newline"} <= keywords
    return name == "read_text" and not call.args and "encoding" not in keywords


def test_text_files_have_one_encoding_and_one_line_end_on_every_system() -> None:
    """Otherwise Windows would use its code page, which lacks many letters, and end lines with two characters."""
    unfit = [
        f"{path.relative_to(ROOT).as_posix()}:{node.lineno}"
        for folder in ("study_app", "tests", "tools", "packaging", "docs")
        for path in sorted((ROOT / folder).rglob("*.py"))
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Call) and text_without_form(node)
    ]
    assert unfit == [], "write encoding and newline"


@pytest.mark.parametrize(
    ("call", "unfit"),
    [
        ("path.write_text(text)", True),
        ('path.write_text(text, encoding="utf-8")', True),
        ('path.write_text(text, encoding="utf-8", newline="\\n")', False),
        ("path.read_text()", True),
        ('path.read_text("utf-8")', False),
        ('path.open("a")', True),
        ('path.open("ab")', False),
        ('path.open("w", encoding="utf-8", newline="")', False),
    ],
)
def test_which_calls_depend_on_the_system(call: str, unfit: bool) -> None:
    expression = ast.parse(call, mode="eval").body
    assert isinstance(expression, ast.Call)
    assert text_without_form(expression) is unfit


def test_a_clone_on_windows_has_the_same_bytes(tmp_path: Path) -> None:
    """Git for Windows converts line ends unless the repository forbids it; the hash of a study would differ."""
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    repository, clone = tmp_path / "made", tmp_path / "clone"
    repository.mkdir()
    names = (".gitattributes", "protocols/demo.toml", "study_app/haptics/kernels/tick.py", "docs/pictures/tank.jpg")
    for name in names:
        (repository / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, repository / name)
    person = ("-c", "user.name=P", "-c", "user.email=p@example.org", "-c", "core.autocrlf=true")
    for words in (("init", "-q", "."), ("add", "."), ("commit", "-q", "-m", "files"), ("clone", "-q", ".", str(clone))):
        subprocess.run(["git", *person, *words], cwd=repository, check=True, capture_output=True)
    assert [name for name in names if (clone / name).read_bytes() != (ROOT / name).read_bytes()] == []
