"""The pages: commands exist or run, links lead somewhere, sections hold every page, the website has no warnings."""

import ast
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import click
import pytest

from study_app import documentation
from study_app.cli import commands
from tests.compiled import needs_servo
from tests.documented import (
    ROOT,
    anchors,
    blocks,
    lines_to_type,
    links,
    mentioned_commands,
    name,
    pages,
    typed_commands,
)

PROGRAM = "liquid-study"
PAGES = [pytest.param(page, id=name(page)) for page in pages()]
LONG = {
    "docs/answers-to-report.md",
    "docs/export.md",
    "docs/first-session.md",
    "docs/own-study.md",
    "docs/preregistration.md",
    "docs/threshold.md",
    "results/README.md",
}
"""Pages whose commands take ten seconds or more."""

RUN = [
    pytest.param(page, id=name(page), marks=pytest.mark.nightly if name(page) in LONG else ())
    for page in pages()
    if any(block.run for block in blocks(page))
]


def faults(words: list[str], *, complete: bool) -> list[str]:
    """Return the errors that the program reports for a command line; with ``complete`` also missing options."""
    command: click.Command = commands
    path, rest = [PROGRAM], words[1:]
    while isinstance(command, click.Group) and rest and not rest[0].startswith("-"):
        if rest[0] not in command.commands:
            if rest[0].isupper():  # a placeholder
                return []
            return [f"{' '.join(path)} has no command {rest[0]}"]
        command, path, rest = command.commands[rest[0]], [*path, rest[0]], rest[1:]
    context = click.Context(command, info_name=" ".join(path))
    try:
        options, extra_words, _ = command.make_parser(context).parse_args(
            [word for word in rest if word not in {"…", "..."}]
        )
    except click.UsageError as error:
        return [f"{' '.join(words)}: {error.format_message()}"]
    errors = [f"{' '.join(words)}: {' '.join(extra_words)} is one word too many"] if extra_words else []
    for parameter in command.params:
        value = options.get(parameter.name)
        if isinstance(parameter.type, click.Choice) and isinstance(value, str) and not value.isupper():
            errors += [f"{' '.join(words)}: {value}" for _ in [0] if value not in parameter.type.choices]
        if complete and parameter.required and value is None:
            errors.append(f"{' '.join(words)}: {parameter.name} is missing")
    return errors


@pytest.mark.parametrize("page", PAGES)
def test_every_command_in_a_block_exists_with_its_options(page: Path) -> None:
    errors: list[str] = []
    for words in typed_commands(page):
        if Path(words[0]).name == PROGRAM:
            errors += faults(words, complete=True)
        elif Path(words[0]).stem.startswith("python") and len(words) > 1 and words[1].endswith(".py"):
            errors += [words[1]] if not (ROOT / words[1]).is_file() else []
    assert not errors


@pytest.mark.parametrize("page", PAGES)
def test_every_command_in_a_sentence_exists_with_its_options(page: Path) -> None:
    assert not [fault for words in mentioned_commands(page) for fault in faults(words, complete=False)]


@pytest.mark.parametrize("page", PAGES)
def test_extras_and_scripts_that_a_page_names_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    with (ROOT / "pyproject.toml").open("rb") as file:
        extras = tomllib.load(file)["project"]["optional-dependencies"]
    assert set(re.findall(r"pip install (?:-e )?'(?:\.|liquid-study)\[(\w+)\]'", text)) <= set(extras)
    named = re.findall(r"\b((?:tests|study_app)/[a-z0-9_/]+\.(?:py|csv|c|h))\b", text)
    assert not [path for path in named if not (ROOT / path).is_file()]


@pytest.mark.parametrize("page", PAGES)
def test_links_and_pictures_within_the_checkout_exist(page: Path) -> None:
    broken_links: list[str] = []
    for link in links(page):
        path, _, anchor = link.partition("#")
        if "://" in link or link.startswith("mailto:"):
            continue
        target = (page.parent / path).resolve() if path else page
        if not target.exists():
            broken_links.append(link)
        elif anchor and target.suffix == ".md":
            text = documentation.with_generated_parts(target.read_text(encoding="utf-8"))
            broken_links += [link] if anchor not in anchors(text) else []
    assert not broken_links


def test_every_page_is_in_one_section() -> None:
    sections = documentation.sections()
    listed = [page for pages_of in sections.values() for page in pages_of]
    assert sorted([documentation.INDEX, *sections, *listed]) == list(documentation.names())
    assert list(sections) == ["begin", "do", "look-up"]


def test_the_book_and_its_layers_are_as_short_as_they_are_to_be() -> None:
    sections = documentation.sections()
    assert len(sections["begin"]) <= 8
    words = {page: len(documentation.source(page).split()) for page in sections["do"]}
    assert not {page: count for page, count in words.items() if count > 660}
    assert (
        sum(len(path.read_text("utf-8").split()) for path in (ROOT / "README.md", *ROOT.glob("docs/**/*.md"))) <= 49_000
    )


def test_every_page_but_decisions_is_in_the_list_of_a_section() -> None:
    top = documentation.folder()
    listed_pages = {
        link.partition("#")[0] for section in documentation.sections() for link in links(top / f"{section}.md")
    }
    here = {f"{page}.md" for page in documentation.names() if page not in documentation.sections()}
    assert {page for page in here - listed_pages if not page.startswith("decisions/")} == {"index.md"}


def test_the_page_on_installation_lists_every_extra() -> None:
    page = ROOT / "docs" / "install.md"
    text = page.read_text(encoding="utf-8")
    with (ROOT / "pyproject.toml").open("rb") as file:
        extras = tomllib.load(file)["project"]["optional-dependencies"]
    rows = re.findall(r"^\| (`\w+`(?:, `\w+`)*) \|", text, re.MULTILINE)
    assert {extra for row in rows for extra in re.findall(r"\w+", row)} == set(extras)
    alone = text.partition("## A computer that only runs sessions")[2]
    assert re.findall(r"pip install (\S+)", alone)[0] == "."


def test_packages_and_the_page_on_architecture_name_modules_that_exist() -> None:
    program = ROOT / "study_app"
    for package in program.glob("*/__init__.py"):
        docstring = ast.get_docstring(ast.parse(package.read_text("utf-8"))) or ""
        names = re.findall(r"``([a-z]\w*(?:\.\w+)*)``", docstring)
        existing = [name for name in names if [*package.parent.glob(f"{name.replace('.', '/')}*")]]
        assert len(existing) >= 3, f"{package.parent.name}: which three modules are to be read first?"
        assert not [name for name in names if "." in name and name not in existing], package.parent.name
    page = documentation.source("architecture")
    paths = re.findall(r"`((?:\w+/)*\w+\.py)`", page)
    assert not [path for path in paths if not [*program.rglob(path), *(ROOT / "tests").rglob(path)]]
    packages = re.findall(r"^\| `(\w+)` \|", page.partition("## Data flow")[0], re.MULTILINE)
    assert not [package for package in packages if not [*program.glob(f"{package}*")]]


def test_generated_parts_are_made_when_a_page_is_read() -> None:
    generated_texts = {
        "commands": "`--participants",
        "data-dictionary": "`lateness_p99_ms`",
        "kinds": "`limiter_slope`",
        "designer-keys": "Ctrl+1",
    }
    for page, words in generated_texts.items():
        assert words not in documentation.source(page)
        assert words in documentation.page(page)
        assert "<!-- generated" not in documentation.page(page)


@pytest.mark.slow
@needs_servo
@pytest.mark.parametrize("page", RUN)
@pytest.mark.timeout(600)
def test_the_commands_of_a_page_run_one_after_the_other(page: Path, tmp_path: Path) -> None:
    for study in ("sample-rek2024", "rek2024"):
        shutil.copytree(ROOT / "results" / "sample-rek2024", tmp_path / "results" / study)
    (tmp_path / "protocols").mkdir()
    environment = os.environ | {
        "LIQUID_STUDY_WORKSPACE": str(tmp_path),
        "LIQUID_STUDY_CONFIG": str(tmp_path / "config"),
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
    }
    for block in blocks(page):
        for line in lines_to_type(block) if block.run else ():
            command = line.replace("liquid-study ", f"{sys.executable} -m study_app ")
            process = subprocess.run(
                ["bash", "-c", command], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
            )
            assert process.returncode == 0, f"{line}\n{process.stdout}\n{process.stderr}"


@pytest.mark.nightly
@pytest.mark.skipif(
    not all(map(importlib.util.find_spec, ("sphinx", "myst_parser", "pydata_sphinx_theme"))), reason="needs extra docs"
)
def test_the_website_builds_without_a_warning_or_the_network(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "sphinx", "-W", "-q", "-b", "html", "-d", str(tmp_path / "trees")]
    build = subprocess.run(
        [*words, str(ROOT / "docs"), str(tmp_path / "html")], capture_output=True, text=True, check=False
    )
    assert build.returncode == 0, build.stderr
    for page, words_on_it in {
        "commands": "--participants",
        "data-dictionary": "lateness_p99_ms",
        "protocol-format": "breaking_angle_deg",
        "api": "study_app.api.open_session",
    }.items():
        assert words_on_it in (tmp_path / "html" / f"{page}.html").read_text(encoding="utf-8")
