"""Whether hard closed loops of liquid, servo, device and hand stay stable, and their maximum stable damping.

Reading order: closed_loop, stability_cases; bench, case_groups; damping_limits, force_delay, verdict, withheld_force;
driver_loop, velocity; delivered_force, stability_report.
"""
