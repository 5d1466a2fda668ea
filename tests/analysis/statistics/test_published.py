"""Which test holds which published data set: one row each, so that none can be lost unseen.

Raw data and printed results stand in the tests named here.
"""

import ast
from pathlib import Path

import pytest

HERE = Path(__file__).parent

PUBLISHED = {
    "Friedman, Kendall's W: base-running times (Hollander & Wolfe 1973)": (
        "test_friedman.py::test_published_times_to_first_base",
        "test_friedman.py::test_published_parts_of_the_times",
    ),
    "Friedman with ties: scipy's documentation": ("test_friedman.py::test_published_whole_scores_with_ties",),
    "Page's L: Siegel & Castellan, Sachs, Duller (R, DescTools and lumen), Statext (scipy), cultevo": (
        "test_trend.py::test_published_trends",
        "test_trend.py::test_published_trends_by_the_normal_approximation",
    ),
    "Wilcoxon, rank-biserial: depression scores (Hollander & Wolfe 1973; R, effectsize)": (
        "test_paired.py::test_published_depression_scores",
    ),
    "Ordinal model: wine (Randall 1989; R, ordinal: clm, clmm, clmm2)": (
        "test_ordinal.py::test_published_model_without_judges",
        "test_ordinal.py::test_published_likelihood_ratio_of_contact",
        "test_ordinal.py::test_published_quadrature_with_judges",
        "test_ordinal.py::test_published_laplace_estimates_are_the_maximum_of_one_node",
        "test_ordinal.py::test_leaving_the_judges_out_shrinks_the_effects",
    ),
    "Equivalence: sleep (Student 1908; R, TOSTER)": ("equivalence/test_tost.py::test_published_sleep_data",),
    "Kendall's W of raters: anxiety (R, irr, DescTools)": (
        "test_agreement.py::test_published_agreement_of_three_raters",
    ),
    "Skillings & Mack (1981), table 1 (R, Skillings.Mack)": (
        "test_skillings_mack.py::test_published_assembly_times",
        "test_skillings_mack.py::test_without_missing_answers_and_ties_it_is_friedmans",
    ),
    "Psychometric functions: psignifit's tests (MATLAB version)": (
        "psychometrics/test_threshold.py::test_published_fits_of_ten_trials",
        "psychometrics/test_threshold.py::test_published_fit_of_ninety_trials",
    ),
    "Friedman's post-hocs: Nemenyi, Conover (R, rstatix)": (
        "test_friedman.py::test_mean_ranks_give_the_published_nemenyi_and_conover_comparisons",
        "test_against_others.py::test_scikit_posthocs",
    ),
    "Binomial regression: beetles (Bliss 1935)": ("psychometrics/test_threshold.py::test_published_beetles",),
    "Percentages: MathAnxiety, PISA reading (R, likert)": (
        "test_percentages.py::test_twenty_students",
        "test_percentages.py::test_every_level_of_the_students_has_its_share",
        "test_percentages.py::test_the_students_by_gender_add_up",
        "test_percentages.py::test_many_pupils_some_of_whom_did_not_answer",
        "test_percentages.py::test_the_counts_hold_the_published_means",
    ),
    "Friedman's exact tails: printed tables, by full enumeration; five people with ties": (
        "test_friedman.py::test_published_exact_tails",
        "test_friedman.py::test_five_people_with_ties_give_the_exact_p_and_not_the_approximate_one",
    ),
    "Holm (statsmodels)": ("test_multiple_comparisons.py::test_published_adjustments",),
    "Cohen's kappa": ("test_agreement.py::test_published_kappa",),
    "Cochran's Q (pingouin, statsmodels)": ("test_friedman.py::test_two_values_give_cochrans_q",),
    "Wilcoxon with ties and zeros (scipy)": (
        "test_paired.py::test_published_differences_with_ties_and_zeros",
        "test_paired.py::test_published_differences_by_the_normal_approximation",
    ),
    "CIEDE2000 (Sharma, Wu & Dalal 2005); palettes to four kinds of eyes (Machado et al. 2009)": (
        "../../test_figure_style.py::test_published_differences_of_colours",
        "../../test_figure_style.py::test_published_differences_of_palettes_to_four_kinds_of_eyes",
    ),
    "What so many participants can reach at all": (
        "test_paired.py::test_the_smallest_p_of_so_many_pairs",
        "test_friedman.py::test_the_smallest_p_of_so_many_people",
        "test_multiple_comparisons.py::test_what_pairs_can_reach_in_a_family",
    ),
    "Critical numbers of hits by matching": (
        "test_recognition.py::test_published_critical_numbers_of_hits",
        "test_recognition.py::test_published_matching_of_five_people",
    ),
    "Power of the equivalence test": ("equivalence/test_tost.py::test_published_power_at_no_difference",),
}


@pytest.mark.parametrize("data", PUBLISHED)
def test_every_published_data_set_has_its_tests(data: str) -> None:
    for name in PUBLISHED[data]:
        file, test = name.split("::")
        tree = ast.parse((HERE / file).read_text(encoding="utf-8"))
        assert test in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}, name
