"""Error rates of the report's verdicts: simulated studies evaluated by the report's own tests."""

from study_app.evidence.report_rates.simulation import Rate, measure_report_rates, report_rates_evidence

__all__ = ["Rate", "measure_report_rates", "report_rates_evidence"]
