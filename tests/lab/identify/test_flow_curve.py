"""Flow curves from a rheometer, and strokes in non-Newtonian liquids: planted parameters are recovered."""

import hashlib
import re

import numpy as np
import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.errors import StudyError
from study_app.haptics.model.laws import stress_pa
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.overrides import override_all
from study_app.lab.identify import measured_force, preset
from study_app.lab.identify.fit import fit, fit_curve
from study_app.lab.identify.measured_force import FlowCurve
from study_app.protocol.load import load_scene
from tests.haptics.materials import PRESETS, tank
from tests.haptics.scenes import COMPILED
from tests.lab.identify.measurements import force_of

pytestmark = pytest.mark.slow

RATES = np.geomspace(0.05, 200, 25)
STARTS = {
    "ketchup": {"yield_stress_pa": 5.0, "consistency_pa_sn": 3.0, "flow_index": 0.6},
    "toothpaste": {"yield_stress_pa": 20.0, "consistency_pa_sn": 200.0, "flow_index": 0.9},
    "shampoo": {"zero_shear_viscosity_pa_s": 2.0, "time_constant_s": 0.5, "flow_index": 0.7},
    "cornstarch": {"zero_shear_viscosity_pa_s": 2.0, "thickened_viscosity_pa_s": 10.0, "onset_shear_rate_per_s": 8.0},
}


def measured(name, *, noise=0.01, rates=RATES, seed=5):
    """Return the flow curve of a preset with a relative error."""
    stresses = np.array([stress_pa(PRESETS[name][1], rate) for rate in rates.tolist()])
    return FlowCurve(rates, stresses * (1 + noise * np.random.default_rng(seed).standard_normal(len(rates))))


def start_scene(name):
    return override_all(tank(name), {f"non_newtonian.{field}": value for field, value in STARTS[name].items()})


@pytest.mark.parametrize("name", STARTS)
def test_planted_parameters_are_recovered_from_a_rheometer_with_1_percent_noise(name):
    result = fit_curve(start_scene(name), name, list(STARTS[name]), measured(name))
    for field, value in result.values.items():
        true = getattr(PRESETS[name][1], field)
        assert value == pytest.approx(true, rel=0.05)
        lower, upper = result.intervals[field]
        assert lower < true < upper
    assert result.share == pytest.approx(0.01, rel=0.4)
    assert result.warnings == ()


def strokes():
    """Return strokes of ±45 mm that get faster, from rest to 0.5 m/s, 6 s at 1 kHz."""
    t_s = np.arange(6000) / 1000
    rate_per_s = 2 * np.pi * (0.2 + 1.5 * t_s / 6)
    angle = 2 * np.pi * (0.2 * t_s + 0.75 * t_s**2 / 6)
    place, speed = 0.045 * np.sin(angle), 0.045 * rate_per_s * np.cos(angle)
    still = np.zeros_like(t_s)
    return Motion(t_s, np.column_stack([place, still, still]), velocity_mps=np.column_stack([speed, still, still]))


@pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")
@pytest.mark.parametrize("name", ["ketchup", "toothpaste", "cornstarch", "slime"])
def test_planted_parameters_are_recovered_from_strokes_with_noise_of_0_03_n(name):
    start = STARTS.get(name, {"zero_shear_viscosity_pa_s": 5.0, "relaxation_time_s": 0.1})
    motion = strokes()
    force_n = force_of(tank(name), motion)
    force_n[:, 0] += 0.03 * np.random.default_rng(6).standard_normal(len(force_n))
    begin = override_all(tank(name), {f"non_newtonian.{field}": value for field, value in start.items()})
    result = fit(begin, name, list(start), motion, force_n)
    for field, value in result.values.items():
        assert value == pytest.approx(getattr(PRESETS[name][1], field), rel=0.05)


def test_a_relaxation_time_does_not_change_a_flow_curve():
    curve = FlowCurve(RATES, 20 * RATES)
    result = fit_curve(tank("slime"), "slime", ["zero_shear_viscosity_pa_s", "relaxation_time_s"], curve)
    assert result.values["zero_shear_viscosity_pa_s"] == pytest.approx(20)
    assert not result.distinguishable
    (warning,) = result.warnings
    assert warning.startswith(
        "relaxation_time_s does not affect the stress at these shear rates, so its initial value 0.3 was kept"
    )


THICKENING = ["zero_shear_viscosity_pa_s", "thickened_viscosity_pa_s", "onset_shear_rate_per_s"]


@pytest.mark.parametrize(("least", "most"), [(5.0, 6.0), (2.0, 2.0), (3.0, 1.0)])
def test_a_liquid_that_hardly_thickens_or_thins_ends_at_equal_viscosities(least, most):
    """Viscosity by the shear rate, below 5 per s and above; the search starts from cornstarch's parameters."""
    stress_pa = np.where(RATES < 5, least, most) * RATES * (1 + 0.02 * np.random.default_rng(1).standard_normal(25))
    result = fit_curve(tank("cornstarch"), "cornstarch", THICKENING, FlowCurve(RATES, stress_pa))
    zero, thickened, _ = result.values.values()
    assert min(least, most) * 0.9 < zero <= thickened < max(least, most) * 1.1
    assert thickened < max(1.02, 1.1 * most / least) * zero


def test_a_narrow_range_of_shear_rates_does_not_separate_the_parameters():
    result = fit_curve(
        start_scene("ketchup"), "ketchup", list(STARTS["ketchup"]), measured("ketchup", rates=np.geomspace(8, 12, 25))
    )
    assert any("cannot be distinguished by these shear rates" in warning for warning in result.warnings)
    assert any("or measure a wider range of shear rates" in warning for warning in result.warnings)


@pytest.mark.parametrize(
    ("names", "rows", "said"),
    [
        (
            ["density_kg_m3"],
            25,
            "density_kg_m3 does not affect a flow curve: fit parameters from the table non_newtonian",
        ),
        (["yield_stress"], 25, "unknown parameter 'yield_stress': did you mean 'yield_stress_pa'"),
        (["yield_stress_pa", "flow_index"], 2, "2 shear rates are too few for 2 parameters"),
    ],
)
def test_an_impossible_curve_fit_is_reported_in_one_line(names, rows, said):
    with pytest.raises(StudyError, match=said) as caught:
        fit_curve(tank("ketchup"), "ketchup", names, measured("ketchup", rates=RATES[:rows]))
    assert "\n" not in str(caught.value)


def write_csv(path, curve):
    rows = np.column_stack([curve.stress_pa, curve.rate_per_s])
    np.savetxt(path, rows, delimiter=",", header="shear_stress_pa,shear_rate_per_s", comments="", fmt="%.17g")
    return path


def identify(*words):
    return CliRunner().invoke(commands, ["identify", *map(str, words)], catch_exceptions=False)


def test_from_a_rheometer_file_to_a_preset(tmp_path):
    path = write_csv(tmp_path / "rheometer.csv", measured("ketchup"))
    fields = ",".join(STARTS["ketchup"])
    result = identify("slime", "--measured", path, "--liquid", "ketchup", "--fit", fields, "--to", tmp_path / "out")
    assert result.exit_code == 0
    assert "ketchup: 25 shear rates from 0.05 to 200 per s; residual 0.9 % of the stress (RMS)" in result.output
    written = load_scene(tmp_path / "out" / "ketchup.toml", "ketchup").liquids[0].non_newtonian
    for field in STARTS["ketchup"]:
        assert getattr(written, field) == pytest.approx(getattr(PRESETS["ketchup"][1], field), rel=0.05)
    text = (tmp_path / "out" / "ketchup.toml").read_text(encoding="utf-8")
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    assert f"# Fitted to rheometer.csv (SHA-256 {digest[:16]}…), " in text
    for field in STARTS["ketchup"]:
        value, lower, upper = re.search(rf"\b{field} = (\S+?),?  # 95 %: (\S+) … (\S+)", text).groups()
        assert float(value) == getattr(written, field)
        assert float(lower) < float(value) < float(upper) < 1.5 * float(value)
    rows = np.genfromtxt(tmp_path / "out" / "ketchup-fit.csv", delimiter=",", names=True)
    assert rows["residual_pa"] == pytest.approx(rows["shear_stress_pa"] - rows["fitted_pa"])
    assert (tmp_path / "out" / "ketchup-fit.png").stat().st_size > 10_000


def test_the_figure_of_a_flow_curve_labels_measurement_and_fit():
    result = fit_curve(start_scene("ketchup"), "ketchup", list(STARTS["ketchup"]), measured("ketchup", noise=0.2))
    above, below = preset.figures.draw_curve(result).axes
    curves = {line.get_label(): line.get_xydata().T for line in above.lines}
    assert (curves["measured"] == [RATES, result.curve.stress_pa]).all()
    fitted_pa = np.exp(np.interp(np.log(RATES), *np.log(curves["fitted"])))
    assert fitted_pa == pytest.approx(result.fitted_pa, rel=1e-3)
    residual = 100 * (result.curve.stress_pa - fitted_pa) / result.curve.stress_pa
    assert below.lines[-1].get_xydata() == pytest.approx(np.column_stack([RATES, residual]), abs=0.2)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("shear_rate_per_s,shear_stress_pa\n1,0\n", "row 1 has shear_stress_pa 0: it must be above 0"),
        ("shear_rate_per_s,shear_stress_pa\n1,5\n-2,6\n", "row 2 has shear_rate_per_s -2: it must be above 0"),
        ("shear_rate_per_s,viscosity_pa_s\n1,5\n", "or shear_rate_per_s,shear_stress_pa from a rheometer"),
    ],
)
def test_a_flow_curve_that_cannot_be_used_is_one_line(tmp_path, text, said):
    (tmp_path / "curve.csv").write_text(text, encoding="utf-8", newline="\n")
    with pytest.raises(StudyError, match=said) as caught:
        measured_force.read_measurement(tmp_path / "curve.csv")
    assert "\n" not in str(caught.value)


def loop(*, gap, noise=0.012, seed=2):
    """Return a ramp up and down over 22 shear rates, whose way back has stresses lower by a share ``gap``."""
    up = measured("ketchup", noise=noise, rates=np.geomspace(0.1, 100, 22), seed=seed)
    down = measured("ketchup", noise=noise, rates=np.geomspace(0.1, 100, 22), seed=seed + 1)
    rates = np.concatenate([up.rate_per_s, down.rate_per_s[::-1]])
    return FlowCurve(rates, np.concatenate([up.stress_pa, (1 - gap) * down.stress_pa[::-1]]))


@pytest.mark.parametrize("gap", [0.0, 0.2])
def test_a_fit_does_not_depend_on_the_order_of_rows(gap):
    curve = loop(gap=gap)
    orders = [
        np.arange(44),
        np.arange(44)[::-1],
        np.argsort(curve.rate_per_s),
        np.random.default_rng(3).permutation(44),
    ]
    curves = [FlowCurve(curve.rate_per_s[order], curve.stress_pa[order]) for order in orders]
    fields = list(STARTS["ketchup"])
    first, *others = (fit_curve(start_scene("ketchup"), "ketchup", fields, ordered) for ordered in curves)
    for other in others:
        assert (other.values, other.intervals, other.autocorrelation) == (
            first.values,
            first.intervals,
            first.autocorrelation,
        )
        assert other.warnings == first.warnings


def test_branches_that_differ_are_named_with_their_gap():
    result = fit_curve(start_scene("ketchup"), "ketchup", list(STARTS["ketchup"]), loop(gap=0.2))
    said = "the largest and smallest stresses at repeated shear rates differ by 25 % of the stress"
    assert any(warning.startswith(said) for warning in result.warnings)
    low, high = result.intervals["yield_stress_pa"]
    assert 1 < low < high < 30


def test_branches_at_other_shear_rates_are_detected_by_the_direction_of_the_ramp():
    curve = loop(gap=0.2)
    rates = curve.rate_per_s * np.where(np.arange(44) < 22, 1.0, 1.05)
    result = fit_curve(start_scene("ketchup"), "ketchup", list(STARTS["ketchup"]), FlowCurve(rates, curve.stress_pa))
    assert any(it.startswith("the stresses at rising and falling shear rates differ by") for it in result.warnings)


def test_noise_makes_no_branches():
    for seed in range(20):
        result = fit_curve(start_scene("ketchup"), "ketchup", list(STARTS["ketchup"]), loop(gap=0.0, seed=10 * seed))
        assert not any("branch" in warning for warning in result.warnings)


def test_a_table_of_an_instrument_gives_the_numbers_of_a_plain_one(tmp_path):
    curve = loop(gap=0.0)
    rows = [f"{rate:.5f},{stress:.3f}" for rate, stress in zip(curve.rate_per_s, curve.stress_pa, strict=True)]
    plain = "shear_rate_per_s,shear_stress_pa\n" + "\n".join(rows)
    said = []
    for text in (plain, plain.replace(",", ";").replace(".", ","), plain.replace(",", "\t")):
        path = tmp_path / "flow.csv"
        path.write_text(text, encoding="utf-8", newline="\n")
        result = identify("slime", "--measured", path, "--liquid", "ketchup", "--fit", ",".join(STARTS["ketchup"]))
        assert result.exit_code == 0
        said.append(result.output)
    assert said[0] == said[1] == said[2]


def test_a_table_with_more_fields_than_its_header_is_refused(tmp_path):
    path = tmp_path / "flow.csv"
    path.write_text(
        "shear_rate_per_s,shear_stress_pa\n1,5,26,7\n2,5,28,6\n4,5,31,3\n6,5,33,3\n", encoding="utf-8", newline="\n"
    )
    with pytest.raises(StudyError) as refusal:
        identify("slime", "--measured", path, "--liquid", "ketchup", "--fit", "flow_index")
    assert str(refusal.value) == f"{path}, line 2: has 4 fields, more than the 2 in the header: write decimal points"
