"""The files of a fit, and the command that turns a measurement into a preset."""

from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.haptics.model.effects.current import Uniform
from study_app.haptics.model.estimators import Kalman
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.overrides import override_all
from study_app.haptics.model.scene import Box, Liquid, Scene
from study_app.lab.identify import measured_force, preset
from study_app.lab.identify.fit import Fit, fit
from study_app.protocol.load import load_scene
from tests.haptics.scenes import COMPILED
from tests.lab.identify.measurements import OIL, REACH, REVERSE, TANK, force_of, noisy_force, write_csv

pytestmark = pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """Return a fit and the file it was measured in."""
    force_n = noisy_force(TANK, REVERSE, 0.02)
    path = write_csv(tmp_path_factory.mktemp("measured") / "tank.csv", REVERSE, force_n)
    start = override_all(TANK, {"drag_coefficient": 0.5})
    return fit(start, "tank", ["drag_coefficient", "scaling"], REVERSE, force_n), path


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene",
    [
        TANK,
        OIL,
        Scene(
            scale=3,
            origin_m=(0.1, -0.2, 1e-5),
            liquids=(
                Liquid(
                    id="river",
                    density_kg_m3=1000,
                    region=Box(size_m=(1, 2, 3)),
                    effects=("drag", "current"),
                    current=Uniform(velocity_mps=(0.1, 0, 0)),
                ),
            ),
        ),
    ],
)
def test_the_preset_is_the_fitted_scene(scene, tmp_path):
    (liquid,) = scene.liquids
    (tmp_path / "measured.csv").write_text("t_s\n", encoding="utf-8", newline="\n")
    fitted_scene = fit(scene, liquid.id, ["density_kg_m3"], REACH, noisy_force(scene, REACH, 0.02))
    file = tmp_path / "preset.toml"
    file.write_text(preset.preset_file_text(fitted_scene, tmp_path / "measured.csv"), encoding="utf-8", newline="\n")
    assert load_scene(file, liquid.id) == fitted_scene.scene.model_copy(update={"velocity": Kalman()})
    assert fitted_scene.scene != scene
    for command in ("check", "scene"):
        result = CliRunner().invoke(commands, [command, str(file)], catch_exceptions=False)
        assert (result.exit_code, f"{liquid.id}: effects listed in the file" in result.output) == (0, True)


@pytest.mark.slow
def test_each_interval_is_beside_its_own_number_in_the_preset(fitted):
    fit_result, path = fitted
    body = fit_result.parameters[0]
    density = replace(body, name="liquid.density_kg_m3", table="liquid", field="density_kg_m3")
    intervals = {"drag_coefficient": (0.41, 0.43), "scaling": (380.0, 421.0), density.name: (990.0, 1013.0)}
    with_density = replace(
        fit_result,
        parameters=(*fit_result.parameters, density),
        values=fit_result.values | {density.name: 1000.0},
        intervals=intervals,
    )
    noted, table = {}, ""
    for line in preset.preset_file_text(with_density, path).splitlines():
        key, _, interval = line.partition("# 95 %: ")
        table = line.strip("[]") if line.startswith("[") else table
        noted |= {f"{table}.{key.split()[0]}": interval} if interval else {}
    assert noted == {
        "scene.body.drag_coefficient": "0.41 … 0.43",
        "liquids.tank.wake.scaling": "380 … 421",
        "liquids.tank.density_kg_m3": "990 … 1013",
    }


@pytest.mark.slow
def test_the_residuals_in_the_table_are_measured_less_fitted(fitted, tmp_path):
    fit_result, path = fitted
    written = preset.write_fit(fit_result, tmp_path / "new", path)
    assert sorted(it.name for it in written) == sorted(it.name for it in (tmp_path / "new").iterdir())
    rows = np.genfromtxt(tmp_path / "new" / "tank-fit.csv", delimiter=",", names=True)
    force_n = force_of(fit_result.scene, REVERSE)
    for k, axis in enumerate("xyz"):
        assert rows[f"fitted_{axis}_n"] == pytest.approx(force_n[:, k], abs=1e-12)
        assert rows[f"residual_{axis}_n"] == pytest.approx(fit_result.measured_n[:, k] - force_n[:, k], abs=1e-12)


@pytest.mark.slow
def test_the_figure_of_a_fit_shows_forces_and_residuals_of_each_axis(fitted):
    speed_mps = np.linspace(0.1, 2, len(REVERSE.t_s))
    velocity_mps = np.outer(speed_mps, [0.48, 0.6, -0.64])
    result = replace(fitted[0], motion=Motion(REVERSE.t_s, REVERSE.position_m, velocity_mps=velocity_mps))
    force, residual, along = preset.figures.draw_force(result).axes
    residual_n = result.measured_n - result.fitted_n
    for axes, named_n in ((force, result.fitted_n), (residual, residual_n)):
        curves = {line.get_label(): line.get_ydata() for line in axes.lines if len(line.get_label()) == 1}
        assert curves.keys() == {"xyz"[axis] for axis in result.axes}
        for axis in result.axes:
            assert curves["xyz"[axis]] == pytest.approx(named_n[:, axis])
    behind = [line.get_ydata() for line in force.lines if len(line.get_label()) > 1][1:]
    assert np.column_stack(behind) == pytest.approx(result.measured_n[:, list(result.axes)])
    along_n = residual_n @ [0.48, 0.6, -0.64]
    assert along.lines[1].get_xydata() == pytest.approx(np.column_stack([speed_mps, along_n]))


def test_the_residual_along_the_motion_is_shown_with_medians_of_speeds_with_twenty_rows():
    """12 intervals of 0.1 m/s: 25 rows in the first, 19 in the sixth, 20 in the last; hands at rest are left out."""
    share = np.arange(25) / 25
    slow_mps, middle_mps, quick_mps = 0.1 + 0.09 * share**2, np.linspace(0.61, 0.69, 19), 1.3 - 0.09 * share[:20] ** 3
    speed_mps = np.concatenate([quick_mps, np.zeros(3), slow_mps, middle_mps])
    along_n = np.sin(37 * np.arange(len(speed_mps))) - 2 * speed_mps
    residual_n = np.outer(along_n, [0.6, 0, -0.8]) + np.outer(np.cos(np.arange(len(speed_mps))), [0.8, 0, 0.6])
    t_s = np.arange(len(speed_mps)) / 100
    motion = Motion(t_s, np.zeros((len(t_s), 3)), velocity_mps=np.outer(speed_mps, [0.6, 0, -0.8]))
    result = Fit(
        scene=TANK,
        liquid_id="tank",
        parameters=(),
        values={},
        intervals={},
        autocorrelation=0.0,
        correlation=np.zeros((0, 0)),
        distinguishable=True,
        warnings=(),
        motion=motion,
        measured_n=residual_n + 3.0,
        fitted_n=np.full(residual_n.shape, 3.0),
        axes=(0, 2),
    )
    *_, along = preset.figures.draw_force(result).axes
    _, dots, medians = along.lines
    moves = speed_mps > 0
    assert dots.get_xydata() == pytest.approx(np.column_stack([speed_mps, along_n])[moves])
    slow, quick = slice(23, 48), slice(0, 20)
    slow_medians = [sorted(values[slow])[12] for values in (speed_mps, along_n)]
    quick_medians = [sum(sorted(values[quick])[9:11]) / 2 for values in (speed_mps, along_n)]
    assert medians.get_xydata() == pytest.approx(np.array([slow_medians, quick_medians]))
    assert along.get_xlim() == pytest.approx((0, 1.05 * 1.3))
    assert along.get_ylim() == pytest.approx((-1.05 * np.abs(residual_n).max(), 1.05 * np.abs(residual_n).max()))


def test_places_along_a_line_follow_from_the_velocity(tmp_path):
    (tmp_path / "line.csv").write_text(
        "t_s,velocity_mps,force_n\n0,0,1\n0.01,0.2,2\n0.02,0.4,3\n0.04,0.4,4\n", encoding="utf-8", newline="\n"
    )
    read = measured_force.read_measurement(tmp_path / "line.csv")
    assert read.motion.position_m[:, 0] == pytest.approx([0, 0.001, 0.004, 0.012])
    assert read.force_n[:, 0].tolist() == [1, 2, 3, 4]


def identify(*words):
    return CliRunner().invoke(commands, ["identify", *map(str, words)], catch_exceptions=False)


@pytest.mark.slow
def test_from_a_file_to_a_preset(tmp_path):
    true = override_all(load_scene("rek2024", "honey"), {"drag_coefficient": 0.61})
    path = write_csv(tmp_path / "honey.csv", REACH, noisy_force(true, REACH, 0.02), comment="# by hand\n")
    result = identify(
        "--measured", path, "rek2024", "--liquid", "honey", "--fit", "drag_coefficient", "--to", tmp_path / "out"
    )
    assert result.exit_code == 0
    assert f"honey: {len(REACH.t_s)} rows over 1.8 s; residual 0.0283 N RMS, 1.2 % of the force" in result.output
    written = load_scene(tmp_path / "out" / "honey.toml", "honey")
    assert written.body.drag_coefficient == pytest.approx(0.61, rel=0.01)
    assert written == true.model_copy(update={"body": written.body, "velocity": Kalman()})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "does not have the columns t_s, x_m"),
        ("t_s,x_m,y_m,z_m\n0,0,0,0\n", "does not have the columns fx_n, fy_n, fz_n"),
        ("t_s,velocity_mps,force_n\n", "has a header but no rows"),
        ("t_s,velocity_mps,force_n\n0,1,2\n0.001,nan,2\n", "line 3: 'nan' is not a finite number"),
        ("t_s,velocity_mps,force_n\n0,1\n", "line 2: has 2 fields"),
        ("t_s,velocity_mps,force_n\n0,1,2\n0,1,2\n", "time must increase"),
        ("t_s,velocity_mps,force_n\n0,1,2\n9,1,2\n", "row 2 is 9 s after"),
        (b"\xff\xfe", "not UTF-8 text"),
        (None, "cannot read"),
    ],
)
def test_a_file_that_cannot_be_used_is_one_line(tmp_path, monkeypatch, capsys, text, said):
    from study_app.cli import main

    path = tmp_path / "measured.csv"
    if text is not None:
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    words = ["--measured", str(path), "rek2024", "--liquid", "honey", "--fit", "drag_coefficient"]
    monkeypatch.setattr("sys.argv", ["liquid-study", "identify", *words])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    (line,) = printed.err.splitlines()
    assert said in line
