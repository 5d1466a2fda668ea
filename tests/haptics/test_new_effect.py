"""An effect is two files and one line of the tick: a copy of the package gets a new one, and a study with it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.haptics.scenes import COMPILED

ROOT = Path(__file__).resolve().parents[2]

DESCRIPTOR = '''
"""A spring to the origin of the scene."""

from typing import Annotated

from study_app.haptics.model.effect import FLOAT, Effect, Fields, Parameter
from study_app.haptics.model.ranges import Frozen, within

BIT = 1 << 20


class Spring(Frozen):
    """A stiffness."""

    stiffness_npm: Annotated[float, within(0, 100, "a weak one")] = 5.0


def _bound_n(extremes):
    return extremes.liquid.spring.stiffness_npm * 0.4


def _fill(record, liquid, scene, first):
    record.stiffness_npm = liquid.spring.stiffness_npm


PARAMETERS: Fields = (("stiffness_npm", FLOAT),)

EFFECT = Effect(
    name="spring",
    label="Spring",
    bit=BIT,
    bound_n=_bound_n,
    exerted_n=_bound_n,
    model=Spring,
    default=Spring(),
    parameters=PARAMETERS,
    fill=_fill,
    controls=(Parameter(name="spring.stiffness_npm", label="Stiffness", unit="N/m"),),
)
'''

KERNEL = '''
"""A spring to the origin of the scene."""

from study_app.haptics.kernels.compiled import part


@part
def spring_force(parameters, liquid, local, state):
    """Add F = -k x to the force, (3,) [N]; it can give back ½ k x²."""
    for axis in range(3):
        force_n = -liquid.spring.stiffness_npm * state.position_m[axis] * local.share
        state.force_n[axis] += force_n
        state.returnable_j -= 0.5 * force_n * state.position_m[axis]
'''

USES = """
import sys
import study_app
from study_app.lab.identify.parameters import find_parameters
from study_app.haptics.model.gate import describe_gate
from study_app.haptics.model.overrides import override_all
from study_app.haptics.model.motion import programmed_motion
from study_app.haptics.runtime.offline import simulate
from study_app.lab.parameters import sections, with_parameter
from study_app.protocol.load import load_scene

print(study_app.__file__)
scene = load_scene(sys.argv[1], "thick")
stiffer = override_all(scene, {"stiffness_npm": 20})
motion = programmed_motion("line", rate_hz=scene.rate_hz)
plain = simulate(override_all(scene, {"effects": "drag"}), motion)
for one, stiffness_npm in ((scene, 5.0), (stiffer, 20.0)):
    table = simulate(one, motion)
    assert abs(table.fx_n - plain.fx_n + stiffness_npm * table.x_m).max() < 1e-9
    assert table.x_m.any()
assert any("spring" in line and "listed" in line for line in describe_gate(scene))
assert any(section.title == "Spring" for section in sections(scene))
assert with_parameter(scene, "effects.spring", "off").liquids[0].effects == ("drag",)
assert find_parameters(scene, "thick", ["stiffness_npm"])[0].most == 100
print("used")
"""


def with_line_before(text: str, before: str, line: str) -> str:
    """Return a text with a line inserted before the only place that begins with these words."""
    assert text.count(before) == 1, before
    return text.replace(before, f"{line}\n{before}")


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """Return a folder with a patched package: two new files, and a line in the tick with its imports."""
    skipped = shutil.ignore_patterns("__pycache__", "*.nbi", "*.nbc")
    shutil.copytree(ROOT / "study_app", tmp_path / "study_app", ignore=skipped)
    shutil.copytree(ROOT / "protocols", tmp_path / "protocols")
    haptics = tmp_path / "study_app" / "haptics"
    (haptics / "model" / "effects" / "spring.py").write_text(DESCRIPTOR, "utf-8")
    (haptics / "kernels" / "effects" / "spring.py").write_text(KERNEL, "utf-8")
    tick = haptics / "kernels" / "tick.py"
    text = with_line_before(
        tick.read_text("utf-8"),
        "from study_app.haptics.kernels.effects.surface import",
        "from study_app.haptics.kernels.effects.spring import spring_force",
    )
    line = "    if liquid.effects & effects.spring.BIT:\n        spring_force(parameters, liquid, local, state)"
    tick.write_text(with_line_before(text, "    if liquid.effects & effects.history.BIT:", line), "utf-8")
    study = (ROOT / "protocols" / "demo.toml").read_text("utf-8")
    study = study.replace(
        'density_kg_m3 = 1400\neffects = ["drag"]', 'density_kg_m3 = 1400\neffects = ["drag", "spring"]'
    )
    assert '"spring"' in study
    (tmp_path / "sprung.toml").write_text(study, "utf-8")
    return tmp_path


def run(folder: Path, *words: str) -> str:
    """Run the copied package in its own process with its own cache; return the output."""
    environment = os.environ | {
        "PYTHONPATH": str(folder),
        "PYTHONSAFEPATH": "1",
        "NUMBA_CACHE_DIR": str(folder / "cache"),
        "LIQUID_STUDY_WORKSPACE": str(folder),
        "QT_QPA_PLATFORM": "offscreen",
    }
    command = [sys.executable, *words]
    finished = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert finished.returncode == 0, finished.stdout + finished.stderr
    return finished.stdout


@pytest.mark.nightly
@pytest.mark.timeout(600)
@pytest.mark.skipif(not COMPILED, reason="runs a servo")
def test_a_new_effect_is_two_files_and_a_line_of_the_tick(copy: Path) -> None:
    lines = run(copy, "-c", USES, "sprung.toml").splitlines()
    assert Path(lines[0]).is_relative_to(copy)
    assert lines[-1] == "used"
    assert "spring" in run(copy, "-m", "study_app", "check", "sprung.toml")
    results = copy / "results" / "sprung"
    run(copy, "-m", "study_app", "rehearse", "sprung.toml", "--participants", "2", "--results", str(results))
    run(copy, "-m", "study_app", "report", str(results), "--to", str(copy / "report"))
    assert list((copy / "report").rglob("*.html"))
