"""What check says of studies: problems of each mistake, and the description of each sound study, whole."""

import math
import re
import sys
from pathlib import Path

import pytest

from study_app.cli import main
from study_app.errors import ProtocolError
from study_app.protocol.descriptions.protocol_text import describe
from study_app.protocol.load import load, parse
from study_app.protocol.warnings.study_warnings import liquid_warnings
from tests.protocol.edited_studies import FILES, Case, cases_of, regenerate, said_of, split, text_of
from tests.protocol.sound import SOUND

DESCRIBED = Path(__file__).parent / "described"
SLOW = {"compared", "late", "methods", "pace", "precision", "rated"}
"""Files whose studies are described with simulated observers."""
BY_HAND = ("demo", "every_design", "grouped", "mixed", "sound", "viscosityjnd")
"""Studies that together have each kind of line; people change their descriptions, no option rewrites them."""


@pytest.fixture(scope="module")
def recorded_anew(request: pytest.FixtureRequest) -> None:
    """Write the recordings of the tests that run."""
    names = {item.name for item in request.session.items if request.config.getoption("regenerate")}
    for file in FILES:
        if any(f"[{file.stem}: " in name for name in names):
            regenerate(file)


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, id=f"{file.stem}: {case.name}", marks=[pytest.mark.slow] if file.stem in SLOW else [])
        for file in FILES
        for case in cases_of(file)
    ],
)
def test_check_prints_the_stated_lines(case: Case, recorded_anew: None) -> None:
    asserted, recorded = split(said_of(case.text, case.study))
    assert asserted == list(case.asserted)
    assert recorded == list(case.recorded)


@pytest.mark.slow
@pytest.mark.parametrize("name", BY_HAND)
def test_a_study_is_described_as_before(name: str) -> None:
    description = describe(parse(text_of(name).encode(), name))
    assert f"{description}\n" == (DESCRIBED / f"{name}.txt").read_text(encoding="utf-8")


def problems_of(text: str | bytes) -> tuple[str, ...]:
    with pytest.raises(ProtocolError) as error:
        parse(text if isinstance(text, bytes) else text.encode(), "file.toml")
    return tuple(map(str, error.value.problems))


def test_a_viscosity_that_a_constant_coefficient_ignores_is_named_with_both_forces() -> None:
    """Of a ball of 50 mm with C_d = 0.4 at 10 times the speed of the hand; at Re = 0.5 Stokes' law is 9 % too low."""
    scene = '[scene]\nscale = 10\nknee = { law = "none" }\nbody = { diameter_m = 0.05, drag_coefficient = 0.4 }\n'
    thick = 'density_kg_m3 = 1000\nviscosity_pa_s = 100\neffects = ["drag"]\ndrag = { law = "constant" }'
    protocol = parse(
        text_of("session").replace("density_kg_m3 = 1450.3", thick).replace("[device]", f"{scene}[device]", 1).encode(),
        "x",
    )
    (warning,) = (warning for warning in liquid_warnings(protocol) if warning.startswith("thick has a viscosity"))
    constant_n, true_n, error_n = map(
        float, re.search(r"is ([\d.]+) instead of ([\d.]+) N, an error of ([\d.]+) N", warning).groups()
    )
    assert constant_n == pytest.approx(0.5 * 1000 * 0.4 * math.pi / 4 * 0.05**2, abs=0.005)
    stokes_n = 3 * math.pi * 100 * 0.05
    assert stokes_n < true_n < 1.15 * stokes_n
    assert error_n == pytest.approx(true_n - constant_n, abs=0.011)


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ('"small"', '"small', 5, "column"),
        ("scale = 10", "scale = 10\nscale = 11", 17, "column 11: the key scale occurs twice in this table"),
        ("scale = 10", "scale = 10\nscale = [\n11]", 18, "column 4: a key occurs twice"),
        ("[liquids.other]", "[liquids.thick]", 26, "column"),
        ("scale = 10", "scale =", 16, "column 8: Invalid value"),
        ("Klein", "Kl\udce9in", 6, "UTF-8"),
    ],
)
def test_broken_toml_gives_line_and_column(old: str, new: str, line: int, words: str) -> None:
    (problem,) = problems_of(SOUND.replace(old, new).encode("utf-8", "surrogateescape"))
    assert problem.startswith(f"line {line}: ")
    assert words in problem


def test_windows_line_endings_do_not_change_the_protocol() -> None:
    text = SOUND.replace("rate_hz = 1000", "rate = 1000")
    assert problems_of(text.replace("\n", "\r\n")) == problems_of(text)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a = " + "[" * 3000 + "]" * 3000, "file: is nested too deeply"),
        ("format = " + "9" * 6000, "file: contains a whole number with more than 64 bits"),
        (SOUND.replace('en = "Small"', f'en = "{"a" * 5000}"'), "at most 500 are"),
        (SOUND.replace('en = "Read this."', f'en = "{"read " * 5000}"'), "at most 20000 are"),
        (SOUND.replace("[tasks.explore]", f"[tasks.{'a' * 5000}]"), "is longer than 60"),
        (SOUND.replace('version = "1.0"', f'version = "{"1" * 5000}"'), "longer than 40"),
        (SOUND.replace('task = "reach"', f'task = "{"task.x" * 1000}"'), "there is no task"),
    ],
    ids=lambda value: value[:30],
)
def test_a_too_long_text_is_a_problem_in_a_short_line(text: str, said: str) -> None:
    problems = problems_of(text)
    assert any(said in problem for problem in problems), problems
    assert max(map(len, problems)) < 500


@pytest.mark.parametrize(
    "text",
    ["\u05e2\u200e 1\u200f", "\u0645\u06cc\u200c\u062e", "\U0001f469\u200d\U0001f52c", "Ł. Rek", "a\nb", "ß – “q” … ²"],
)
def test_a_title_in_any_script_is_a_title(text: str) -> None:
    text_with_title = SOUND.replace('title = { en = "Small"', f'title = {{ en = """{text}"""')
    assert parse(text_with_title.encode(), "file.toml").study.title


@pytest.mark.parametrize(
    ("old", "new", "ticks", "code", "said"),
    [
        ("levels = [0.02, 0.6]", "levels = [0.02, 0.6]\nstandards = [16]", "1", 0, "Duration"),
        ("levels = [0.02, 0.6]", "levels = [0.02, 0.6]\nstandards = [16]", "2", 2,
         "produces up to 25.6 N·s/m of damping at the hand, but the slope limit (1000 Hz, kalman, 2 ticks) is 20.6"),
        ("", "", "5", 2, "5 is not a whole number from 1 to 4"),
        ("levels = [0.02, 0.6]", "levels = [0.6, 0.02]", "1", 2, "stimuli.damping.levels"),
    ],
)  # fmt: skip
def test_the_command_prints_problems_and_judges_levels_for_a_delay(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    old: str,
    new: str,
    ticks: str,
    code: int,
    said: str,
) -> None:
    path = tmp_path / "rows.toml"
    path.write_text(text_of("rows").replace(old, new, 1), encoding="utf-8", newline="\n")
    monkeypatch.setattr(sys, "argv", ["liquid-study", "check", str(path), "--delay-ticks", ticks])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == code
    printed = capsys.readouterr()
    assert said in printed.out + printed.err


@pytest.mark.parametrize("name", ["rek2024", "demo"])
def test_the_thesis_studies_warn_only_of_unstated_values(name: str) -> None:
    _, _, warnings = describe(load(name)).partition("Warnings\n")
    places = [line.split()[0] for line in warnings.splitlines()]
    assert places == {"rek2024": ["analysis.participants", "tasks.reach:"], "demo": []}[name]
