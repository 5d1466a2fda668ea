"""Studies that could be read, but in which nothing would be felt, nothing would differ, or no trial could end."""

from pathlib import Path

import numpy as np
import pytest

from study_app.cli import main
from study_app.errors import ProtocolError
from study_app.haptics.model.motion import Motion
from study_app.protocol.felt import LEAST_N, force_n
from study_app.protocol.load import load, parse, shipped, source_bytes
from study_app.protocol.trials.tasks.explore import Explore
from study_app.protocol.trials.tasks.stroke import Stroke
from tests.compiled import needs_servo
from tests.protocol.sound import DECIDED, SOUND

THICK = "[liquids.thick]\ndensity_kg_m3 = 1400\n"
THIN = 'effects = ["drag", "wake"]\nwake = { length = 100, scaling = 200, exponent = 0.5 }'
COUNT = "count = 4\ntimeout_s = 60"
ITEM = 'text = { en = "It is cold.", nl = "Het is koud." }'
SHORT = 'short = { en = "Cold", nl = "Koud" }'
LABELS = 'labels.en = ["a", "b", "c", "d", "e", "f", "g"]'
TITLE = 'title = { en = "Small", nl = "Klein" }'
DELAYED = "delay_ms = 120"
RANGE = "must be at "


def scene(table: str) -> tuple[str, str]:
    return "scale = 10", f"scale = 10\n{table}"


def thick(keys: str) -> tuple[str, str]:
    return THICK, THICK + keys + "\n"


def limits(keys: str) -> tuple[str, str]:
    return "[scales.agreement]", f"[limits]\n{keys}\n[scales.agreement]"


def decided(keys: str) -> tuple[str, str]:
    return "[pages.hello]", DECIDED.replace("names", f"{keys}\nnames") + "[pages.hello]"


FELT = ("blocks.feel.conditions", "less than 0.01 N: it cannot be perceived")

# name of the case, (old, new) text, place of the fault, words of its line
IMPOSSIBLE: tuple[tuple[str, tuple[str, str], str, str], ...] = (
    # nothing is felt
    ("no effects", (THIN, "effects = []"), *FELT),
    ("only what has no force", (THICK, '[liquids.thick]\ndensity_kg_m3 = 1000\neffects = ["buoyancy"]\n'), *FELT),
    ("density of nothing", ("density_kg_m3 = 1400", "density_kg_m3 = 1e-300"), "liquids.thick.density_kg_m3", RANGE),
    ("density of a gas", ("density_kg_m3 = 1400", "density_kg_m3 = 0.01"), *FELT),
    ("density of a star", ("density_kg_m3 = 1400", "density_kg_m3 = 1e308"), "liquids.thick.density_kg_m3", RANGE),
    ("no drag", scene("body.drag_coefficient = 0"), *FELT),
    ("drag of a wall", scene("body.drag_coefficient = 1e308"), "scene.body.drag_coefficient", RANGE),
    ("ball of a mote", scene("body.diameter_m = 1e-300"), "scene.body.diameter_m", RANGE),
    ("ball of 1 mm", scene("body.diameter_m = 0.001\nbody.drag_coefficient = 0.01"), *FELT),
    ("ball as large as a house", scene("body.diameter_m = 20"), "scene.body.diameter_m", RANGE),
    ("ball of nothing", scene("body.density_kg_m3 = 1e-300"), "scene.body.density_kg_m3", RANGE),
    ("frozen velocity", scene('velocity = { kind = "ewma", alpha = 1e-300 }'), "scene.velocity.alpha", RANGE),
    ("no scale", ("scale = 10", "scale = 1e-300"), "scene.scale", RANGE),
    ("force limit of nothing", ("force_limit_n = 8", "force_limit_n = 1e-300"), "device.force_limit_n", RANGE),
    ("knee at once", scene("knee.threshold_mps = 1e-300"), "scene.knee.threshold_mps", RANGE),
    ("knee never", scene("knee.threshold_mps = 1e308"), "scene.knee.threshold_mps", RANGE),
    ("region elsewhere", thick('region = { kind = "box", centre_m = [5, 0, 0], size_m = [1, 1, 1] }'),
     "conditions.is_thick", "outside the tank"),
    ("cylinder elsewhere", thick('region = { kind = "cylinder", centre_m = [0, 2, 0], radius_m = 1, height_m = 1 }'),
     "conditions.is_thick", "outside the tank"),
    ("tank elsewhere", scene("origin_m = [1e308, 0, 0]"), "scene.origin_m", RANGE),
    ("region of nothing", thick('region = { kind = "box", size_m = [1, 1e-300, 1] }'),
     "liquids.thick.region.size_m", RANGE),
    ("region of everything", thick('region = { kind = "box", size_m = [1, 1e308, 1] }'),
     "liquids.thick.region.size_m", RANGE),
    # numbers that no liquid has
    ("viscosity of nothing", thick("viscosity_pa_s = 1e-300"), "liquids.thick.viscosity_pa_s", RANGE),
    ("viscosity of rock", thick("viscosity_pa_s = 1e308"), "liquids.thick.viscosity_pa_s", RANGE),
    ("wake at once", ("exponent = 0.5", "exponent = 1e-300"), "liquids.thin.wake.exponent", RANGE),
    ("wake forgotten at once", ("exponent = 0.5", "exponent = 0.5, decay = 1e-300"), "liquids.thin.wake.decay", RANGE),
    ("wake of one element", ("exponent = 0.5", "exponent = 0.5, resolution_m = 1e308"),
     "liquids.thin.wake.resolution_m", RANGE),
    ("wake that never turns", ("exponent = 0.5", "exponent = 0.5, breaking_span_m = 1e308"),
     "liquids.thin.wake.breaking_span_m", RANGE),
    ("current of light", thick('current = { kind = "uniform", velocity_mps = [1e308, 0, 0] }'),
     "liquids.thick.current.velocity_mps", RANGE),
    ("vortex of light", thick('current = { kind = "vortex", core_m = 1, peak_mps = 1e308 }'),
     "liquids.thick.current.peak_mps", RANGE),
    ("vortex without core", thick('current = { kind = "vortex", core_m = 1e-300, peak_mps = 1 }'),
     "liquids.thick.current.core_m", RANGE),
    ("channel without walls", thick('current = { kind = "channel", width_m = 1e308, peak_mps = 1 }'),
     "liquids.thick.current.width_m", RANGE),
    ("everything left out", scene("accuracy.absolute_n = 1e308"), "scene.accuracy.absolute_n", RANGE),
    ("motion of light", scene("motion.speed_mps = 1e308"), "scene.motion.speed_mps", RANGE),
    ("motion that never starts", scene("motion.acceleration_mps2 = 1e-300"), "scene.motion.acceleration_mps2", RANGE),
    ("depth of space", scene("motion.depth_m = [0, 1e308]"), "scene.motion.depth_m", RANGE),
    # nothing differs
    ("equal liquids", ("density_kg_m3 = 1400", "density_kg_m3 = 1200"), "liquids.other", 'same numbers as "thick"'),
    ("equal liquids but for a table that means nothing",
     (THICK, "[liquids.thick]\ndensity_kg_m3 = 1200\nadded_mass.coefficient = 1\n"), "liquids.other", "same numbers"),
    ("equal conditions", (DELAYED, "delay_ms = 0"), "blocks.look.conditions.2", 'the same as "on_time"'),
    # no trial can end, or every one does
    ("dwell beyond the limit", (COUNT, "count = 4\ntimeout_s = 0.5"), "tasks.reach.dwell_s", "takes as long as"),
    ("targets beyond the limit", (COUNT, "count = 400\ntimeout_s = 60"), "tasks.reach.dwell_s", "each of 400 targets"),
    ("dwell beyond the duration", (COUNT, "duration_s = 0.4"), "tasks.reach.dwell_s", "takes as long as"),
    ("target at the end of the world", ("[30, 0, 0]", "[1e308, 0, 0]"), "tasks.reach.targets_mm.2.1", RANGE),
    ("target of nothing", ("radius_mm = 6", "radius_mm = 1e-300"), "tasks.reach.radius_mm", RANGE),
    ("trial of nothing", ("min_s = 3\nmax_s = 9", "min_s = 0\nmax_s = 1e-300"), "tasks.explore.max_s", RANGE),
    ("time limit of nothing", (COUNT, "count = 4\ntimeout_s = 1e-300"), "tasks.reach.timeout_s", RANGE),
    *((f"limit {key} = {value}", limits(f"{key} = {value}"), f"limits.{key}", RANGE)
      for key in ("lateness_ms", "worst_gap_ms", "delay_error_ms", "frame_gap_ms", "withheld_percent",
                  "targets_percent")
      for value in ("1e308", "1e-300")),
    ("nothing is significant", decided("alpha = 1e-300"), "analysis.alpha", RANGE),
    ("nothing is equivalent", decided("equivalence_bound = 1e-300"), "analysis.equivalence_bound", RANGE),
    # texts that nobody can read or tell apart
    ("statement twice", (ITEM, 'text = { en = "It is  WARM.", nl = "Het is koud." }'),
     "questionnaires.short.items.2.text", "reads as an earlier item"),
    ("short name twice", (SHORT, 'short = { en = "Warm", nl = "Koud" }'),
     "questionnaires.short.items.2.short", "reads as an earlier item"),
    ("equal labels", (LABELS, LABELS.replace('"b"', '"A"')),
     "scales.agreement.labels.en.2", "reads as an earlier label"),
    ("empty label", (LABELS, LABELS.replace('"b"', '" "')), "scales.agreement.labels.en.2", "is empty"),
    ("label off the scale on it", (LABELS, LABELS + '\ncannot_judge = { en = "g", nl = "z" }'),
     "scales.agreement.cannot_judge", "reads as an earlier label"),
    ("title with NUL", (TITLE, r'title = { en = "Sm\u0000all", nl = "Klein" }'), "study.title", "U+0000"),
    ("title read backwards", (TITLE, r'title = { en = "Sm\u202Eall", nl = "Klein" }'), "study.title", "U+202E"),
    ("title of nothing visible", (TITLE, r'title = { en = "\u200B", nl = "Klein" }'), "study.title", "is empty"),
    ("title of 5,000 letters", (TITLE, f'title = {{ en = "{"a" * 5000}", nl = "Klein" }}'),
     "study.title", "more than 500"),
    ("page of a book", ('en = "Read this."', f'en = "{"read " * 5000}"'), "pages.hello.body", "more than 20000"),
    ("description with a bell", (TITLE, TITLE + '\ndescription = "\\u0007"'), "study.description", "U+0007"),
    ("id of 5,000 letters", ("[tasks.explore]", f"[tasks.{'a' * 5000}]"), "tasks.aaa", "is longer than 60"),
    ("version of 5,000 letters", ('version = "1.0"', f'version = "{"1" * 5000}"'), "study.version", "longer than 40"),
    # values of another kind
    ("format that is true", ("format = 1", "format = true"), "format", "must be 1"),
    ("format with a fraction", ("format = 1", "format = 1.0"), "format", "must be 1"),
    ("block that names itself", ("part = 1", 'part = 1\nid = "look"'), "blocks.feel.id", "unknown key"),
    ("key renamed to id", ('setting_label = { en = "Delay"', 'id = { en = "Delay"'), "blocks.look.id", "unknown key"),
    ("liquid that names itself", thick('id = "thin"'), "liquids.thick.id", "unknown key"),
    ("table among items", decided("falling = [{}]"), "analysis.falling.1", "must be a string"),
    ("table for a list", decided("falling = { warm = {} }"), "analysis.falling", "must be an array"),
)  # fmt: skip


@pytest.mark.parametrize(
    ("edit", "place", "words"), [case[1:] for case in IMPOSSIBLE], ids=[it[0] for it in IMPOSSIBLE]
)
def test_an_impossible_value_is_refused_in_one_line_with_its_place(
    edit: tuple[str, str],
    place: str,
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    old, new = edit
    assert SOUND.count(old) == 1, old
    file = tmp_path / "file.toml"
    file.write_text(SOUND.replace(old, new), encoding="utf-8")
    monkeypatch.setattr("sys.argv", ["liquid-study", "check", str(file)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    said = capsys.readouterr().err.splitlines()[1:]
    assert any(f": {place}" in line and words in line for line in said), said
    assert all(len(line) < 500 for line in said)


LEARNS = 'learn = "threshold" '
SLIDER = '[questionnaires.s]\nintro = "x"\nitems = [{ id = "a", text = "A?", short = "A", '


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("value = 0.19 ", "value = 1e308", "published.1.value"),
        ("value = 0.19 ", "value = 0.19\nhigh = 1e308", "published.1.high"),
        ("n = 10 ", "n = 1_000_000_000", "published.1.n"),
        ('source = "Jones', 'source = "\\u202EJones', "published.1.source"),
        ('source = "Jones', f'source = "{"Jones" * 1000}', "published.1.source"),
        (LEARNS, f"{LEARNS}\nstop = {{ ratio = 1e308 }}", "stop.ratio"),
        (LEARNS, f"{LEARNS}\nstop = {{ ratio = 1.2, after = 1_000_000_000 }}", "stop.after"),
        (LEARNS, f"{LEARNS}\nwidths = [1e-300, 1]", "widths.1"),
        (LEARNS, f"{LEARNS}\nwidth_prior = [0.5, 1e308]", "width_prior.2"),
        ("[limits]", f'{SLIDER}kind = "number", from = 1e13 }}]\n[limits]', "items.1.from"),
        ("[limits]", f'{SLIDER}kind = "slider", low = "l", high = "h", to = 1e308, step = 1e307 }}]\n[limits]', "1.to"),
        ("[limits]", '[methods.set]\nkind = "adjustment"\nstep_size = 1e-300\n[limits]', "set.step_size"),
        ("[limits]", '[methods.up]\nkind = "updown"\nstep_up = 1e308\n[limits]', "up.step_up"),
        ("[limits]", '[methods.up]\nkind = "updown"\nstop = { reversals = 1001 }\n[limits]', "stop.reversals"),
    ],
)
def test_an_impossible_value_of_a_study_of_levels_is_refused(old: str, new: str, place: str) -> None:
    text = source_bytes("viscosityjnd").decode()
    assert text.count(old) == 1, old
    with pytest.raises(ProtocolError) as caught:
        parse(text.replace(old, new).encode(), "file.toml")
    assert any(one.place.endswith(place) for one in caught.value.problems), caught.value.problems


def test_a_range_gives_its_reason() -> None:
    with pytest.raises(
        ProtocolError, match=r"viscosity_pa_s: is 1e\+308, must be at most 1e\+06 \(gases have 1e-5 Pa·s"
    ):
        parse(SOUND.replace(THICK, THICK + "viscosity_pa_s = 1e308\n").encode(), "file.toml")


def test_equal_delays_that_are_meant_are_replicates_and_equal_liquids_are_not() -> None:
    again = '[conditions.again]\nliquids = ["thin", "thick"]\ndelay_ms = 120\n\n[conditions.apart]'
    text = SOUND.replace("[conditions.apart]", again).replace('["on_time", "both"]', '["on_time", "both", "again"]')
    with pytest.raises(ProtocolError, match=r'"again" presents the same as "both" .* or write replicates = true'):
        parse(text.encode(), "file.toml")
    meant = text.replace('code_prefix = "D"', 'code_prefix = "D"\nreplicates = true')
    assert parse(meant.encode(), "file.toml").blocks["look"].replicates
    with pytest.raises(ProtocolError, match=r'presents the same as "on_time" \(change it, or use repetitions\)'):
        parse(meant.replace(DELAYED, "delay_ms = 0").encode(), "file.toml")
    with pytest.raises(ProtocolError, match='"again" presents the same as "both"'):
        parse(text.replace("delay_ms = 120", "delay_ms = 120.0000001", 1).encode(), "file.toml")


@pytest.mark.parametrize(
    "text",
    ["\u05e2\u200e 1\u200f", "\u0645\u06cc\u200c\u062e", "\U0001f469\u200d\U0001f52c", "Ł. Rek", "a\nb", "ß – “q” … ²"],
)
def test_a_title_in_any_script_is_a_title(text: str) -> None:
    written = SOUND.replace('title = { en = "Small"', f'title = {{ en = """{text}"""')
    assert parse(written.encode(), "file.toml").study.title


@needs_servo
@pytest.mark.parametrize("name", shipped())
def test_the_estimated_force_is_near_that_of_the_model(name: str) -> None:
    """The estimate decides whether anything is felt; the compiled model says what is."""
    from study_app.haptics.runtime.offline import simulate

    protocol = load(name)
    stroke = Explore(kind="explore", min_s=1, max_s=2, instruction="x").fastest_stroke(protocol.device.workspace_m)
    assert stroke == Stroke(5.0, 0.03)
    for condition in protocol.conditions:
        weak = protocol.scene_for(condition)
        weak = weak.model_copy(update={"scale": weak.scale / 5, "force_limit_n": 20.0})  # below every limit
        t_s = np.arange(2000) / weak.rate_hz
        along_m = weak.scale * stroke.amplitude_m * np.cos(2 * np.pi * stroke.frequency_hz * t_s)
        found = simulate(weak, Motion(t_s, np.column_stack((along_m, 0 * t_s, 0 * t_s))))
        peak_n = float(np.sqrt(found.fx_n**2 + found.fy_n**2 + found.fz_n**2).max())
        assert LEAST_N < peak_n < 3 * force_n(weak, stroke) < 20 * peak_n, condition
