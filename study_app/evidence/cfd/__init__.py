"""The force on a ball in a viscous liquid by a fluid solver, a reference that is independent of our models.

``solved_cases`` has the liquids and motions, ``flow`` solves them (with the extra ``cfd``), ``solver`` checks and
stores the results: the ``*.csv`` in this folder, which ``stored_flows`` reads without the extra. ``fits`` and
``law_fit`` fit models to them and report how well they agree.

Reading order: flow, score, solved_cases; stored_flows; fits, solver; law_fit, yield_flow.
"""

from study_app.evidence.cfd.fits import fit_all, fits_evidence, score_all
from study_app.evidence.cfd.law_fit import law_fit_evidence, refit_law
from study_app.evidence.cfd.solver import solve
from study_app.evidence.cfd.stored_flows import held_out, load_steady, load_tables, training
from study_app.evidence.cfd.yield_flow import solve_materials, stored_materials, yield_flow_evidence

__all__ = [
    "fit_all",
    "fits_evidence",
    "held_out",
    "law_fit_evidence",
    "load_steady",
    "load_tables",
    "refit_law",
    "score_all",
    "solve",
    "solve_materials",
    "stored_materials",
    "training",
    "yield_flow_evidence",
]
