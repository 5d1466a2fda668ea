"""Fixtures: separate settings, the built template, and the stand-in for Force Dimension's library."""

import importlib.util
import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.devices.force_dimension.standin import COMPILER, StandIn, build
from tests.plug_in_packages import TEMPLATE, forget_plug_ins, install


@pytest.fixture
def falcon_socket(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Install the Falcon behind a socket as another package's device, for this and for other processes."""
    site = tmp_path / "packages"
    site.mkdir()
    points = {"falcon-socket": "tests.devices.falcon.served_device:FALCON_SOCKET"}
    install(site, "liquid_study_socket", "device", points)
    monkeypatch.syspath_prepend(site)
    paths = (str(site), str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH"))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, paths)))  # an empty one is the present folder
    forget_plug_ins()
    yield
    forget_plug_ins()


@pytest.fixture(autouse=True)
def own_settings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep calibrations of this machine's user away from tests."""
    monkeypatch.setenv("LIQUID_STUDY_CONFIG", str(tmp_path / "settings"))


@pytest.fixture(scope="session")
def built_template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the built template's modules, with the metadata of an installed package."""
    if COMPILER is None or sys.platform == "win32" or importlib.util.find_spec("setuptools") is None:
        pytest.skip("the template is built by setuptools and a POSIX compiler ('cc')")
    folder = tmp_path_factory.mktemp("template") / "package"
    shutil.copytree(TEMPLATE, folder)
    command = [sys.executable, "-W", "ignore", "setup.py", "-q", "build_ext", "--inplace"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    project = tomllib.loads((folder / "pyproject.toml").read_text("utf-8"))["project"]
    install(folder / "src", "liquid_study_example", "device", project["entry-points"]["liquid_study.devices"])
    return folder / "src"


@pytest.fixture
def template(built_template: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Install the built template."""
    monkeypatch.syspath_prepend(built_template)
    forget_plug_ins()
    yield built_template
    forget_plug_ins()


@pytest.fixture(scope="session")
def standin_library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if COMPILER is None or sys.platform == "win32":
        pytest.skip("the stand-in is built by a POSIX compiler ('cc')")
    return build(tmp_path_factory.mktemp("standin"))


@pytest.fixture
def standin(standin_library: Path) -> Iterator[StandIn]:
    stand_in = StandIn(standin_library)
    stand_in.loaded.standin_reset()
    yield stand_in
    stand_in.loaded.standin_reset()


@pytest.fixture(scope="session")
def shared_standin(tmp_path_factory: pytest.TempPathFactory) -> StandIn:
    """Return a stand-in whose device is a file: it outlives its program."""
    if COMPILER is None or sys.platform == "win32":
        pytest.skip("the stand-in is built by a POSIX compiler ('cc')")
    folder = tmp_path_factory.mktemp("shared")
    state = folder / "device"
    state.touch()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("STANDIN_FILE", str(state))
        return StandIn(build(folder))


@pytest.fixture
def unwatched(shared_standin: StandIn, monkeypatch: pytest.MonkeyPatch) -> StandIn:
    """Return a device without a watchdog, which therefore has a guard."""
    monkeypatch.setenv("STANDIN_FILE", str(shared_standin.path.with_name("device")))
    shared_standin.loaded.standin_reset()
    shared_standin.fault("unwatched")
    return shared_standin
