import pytest

from study_app.errors import ProtocolError
from tests.protocol.trials.level_studies import study

STIMULUS = 'stimulus = "viscosity"'
DRAG = 'effects = ["drag"]\ndrag = { law = "haider-levenspiel" }'
NUMBER = ('design = "2ifc"', 'design = "n"')
ESTIMATION = '[designs.n]\nkind = "estimation"\n'
VALUE = ("standards = [1, 2]", 'level = "value"')
BREAKS = 'break_every = 48\nbreak_page = "rest"\n'
REST = '[pages.rest]\nkind = "break"\ntitle = "Rest"\nbody = "Rest."\n'


@pytest.mark.parametrize(
    ("edits", "more", "place", "message"),
    [
        ([("[stimuli.viscosity]\ncondition", "[stimuli.viscosity]\nkondition")], "", "kondition", "unknown key"),
        ([('condition = "oil"\nvary', 'condition = "oill"\nvary')], "", "condition", 'there is no condition "oill"'),
        ([('condition = "oil"\nvary', "vary")], "", "condition", "is missing, and the study has several"),
        ([('"viscosity_pa_s"', '"viscosty_pa_s"')], "", "vary", 'did you mean "viscosity_pa_s"?'),
        *(
            ([('"viscosity_pa_s"', f'"{name}"')], "", "vary", f"{name} does not belong to a liquid")
            for name in ("force_limit_n", "scene.scale", "threshold_mps", "relative", "fade_s")
        ),
        ([('"viscosity_pa_s"', '"drag.law"'), ("standards = [1, 2]\n", "")], "", "vary", 'no number "drag.law"'),
        (
            [('liquid = "thin"\n\n[conditions.other]', 'liquids = ["thin", "thick"]\n\n[conditions.other]')],
            "",
            "condition",
            "has 2 liquids: which one's number is varied?",
        ),
        (
            [(f"{DRAG}\n\n[liquids.thick]", 'effects = "auto"\n\n[liquids.thick]')],
            "",
            "vary",
            'the effects of "thin" would be selected again at every level',
        ),
        ([("levels = [0.1, 0.8]", "levels = [0.8, 0.1]")], "", "levels", "the first level must be the smaller"),
        ([("levels = [0.1, 0.8]", "levels = [0, 0.8]")], "", "levels", "0 has no logarithm"),
        ([("[0.2, 0.4, 0.8]", "[0.2, 0.9]")], "", "levels", "0.9 is not within the stimulus' levels"),
        ([VALUE, ("[0.1, 0.8]", "[0.1, 1e7]"), ("[0.2, 0.4, 0.8]", "3")], "", "levels", "gives 1e+07"),
        (
            [('vary = "viscosity_pa_s"', 'vary = "delay_ms"'), ("standards = [1, 2]", "standards = [194]"),
             ("levels = [0.1, 0.8]", "levels = [1, 944]"), ("[0.2, 0.4, 0.8]", "3")],
            "",
            "levels",
            "944 ms above a standard of 194 is 1138; delay_ms may be at most 1000 (at most 806)",
        ),
        (
            [('vary = "viscosity_pa_s"', 'vary = "delay_ms"'), ("standards = [1, 2]", "standards = [-1]"),
             ("levels = [0.1, 0.8]", "levels = [5, 100]"), ("[0.2, 0.4, 0.8]", "3")],
            "",
            "standards",
            "-1 is not possible for delay_ms (from 0 to 1000)",
        ),
        (
            [('vary = "viscosity_pa_s"', 'vary = "delay_ms"'), ("standards = [1, 2]", "standards = [0]"),
             ("levels = [0.1, 0.8]", "levels = [1e-300, 100]"), ("[0.2, 0.4, 0.8]", "3")],
            "",
            "levels",
            "1e-300 gives the same as the standard of 0: nothing differs (the comparison must differ by at least",
        ),
        ([("standards = [1, 2]", "standards = [1e-9]")], "", "standards", "1e-09: "),
        ([("[0.1, 0.8]", "[1e-12, 0.8]")], "", "levels", "1e-12 gives the same as the standard of 1"),
        ([('design = "2ifc"', 'design = "2ifx"')], "", "design", 'there is no design "2ifx" (did you mean "2ifc"?)'),
        ([('method = "few"', 'method = "fev"')], "", "method", 'there is no method "fev"'),
        ([(STIMULUS, 'stimulus = "viscosty"')], "", "stimulus", 'there is no stimulus "viscosty"'),
        ([(STIMULUS, STIMULUS + '\nconditions = ["oil"]')], "", "conditions", "either conditions or stimulus"),
        ([(STIMULUS + "\n", ""), ('method = "few"\n', "")], "", "conditions", "either conditions or stimulus"),
        ([(STIMULUS, STIMULUS + "\nrepetitions = 2")], "", "repetitions", "give it in the method's table"),
        ([(STIMULUS, STIMULUS + "\nstandards = [3]")], "", "standards", "has no standard 3 (these: 1, 2)"),
        (
            [(STIMULUS + '\ndesign = "2ifc"\nmethod = "few"', 'conditions = ["oil", "other"]\ndesign = "2ifc"')],
            "",
            "standard",
            "must be one of at least two conditions",
        ),
        (
            [(STIMULUS + '\ndesign = "2ifc"\nmethod = "few"',
              'conditions = ["oil", "other"]\nstandard = "oil"\ndesign = "estimation"')],
            "",
            "design",
            "has one interval and compares nothing",
        ),
        ([NUMBER], ESTIMATION + 'feedback = "always"', "feedback", "no answer is correct"),
        (
            [('design = "2ifc"', 'design = "estimation"\nuntil = { right = 1, of = 2 }')],
            "",
            "until",
            "has no correct answer",
        ),
        ([VALUE, ('design = "2ifc"', 'design = "2ifc"\nuntil = { right = 1, of = 2 }')], "", "until",
         "a forced choice at levels of values has no correct answer"),
        ([VALUE, ('design = "2ifc"', 'design = "yesno"')], "", "design", '"yesno" presents a standard'),
        ([VALUE, NUMBER], '[designs.n]\nkind = "2ifc"\nfeedback = "always"', "feedback", "no answer is correct"),
        ([('design = "2ifc"', 'design = "2ifc"\nuntil = { right = 3, of = 2 }')], "", "right", "3 of 2 answers"),
        (
            [NUMBER],
            ESTIMATION + "modulus = { level = 0.5, number = 10 }",
            "design",
            "a modulus needs a single standard",
        ),
        ([(STIMULUS, BREAKS + STIMULUS)], REST, "break_every", "the block has 48 trials: no break would come"),
        ([('design = "2ifc"', 'design = "rating"')], "", "design", 'the kind "rating" has no default for scale'),
        ([NUMBER], '[designs.n]\nkind = "rating"\nscale = "s"', "scale", 'there is no scale "s"'),
    ],
)  # fmt: skip
def test_a_problem_is_named_with_its_place(edits: list[tuple[str, str]], more: str, place: str, message: str):
    with pytest.raises(ProtocolError) as caught:
        study(*edits, more=more)
    problems = [(problem.place, str(problem)) for problem in caught.value.problems]
    assert any(where.endswith(place) and message in said for where, said in problems), problems
    assert all(problem.line for problem in caught.value.problems)


@pytest.mark.parametrize("design", ["oddity", "abx", "samedifferent"])
def test_designs_whose_answer_is_correct_at_any_level_take_values_feedback_and_a_criterion(design: str):
    until = 'design = "n"\nuntil = { right = 1, of = 2 }'
    study(VALUE, ('design = "2ifc"', until), more=f'[designs.n]\nkind = "{design}"\nfeedback = "always"')
