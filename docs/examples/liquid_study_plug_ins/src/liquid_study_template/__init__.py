"""Plug-ins for liquid-study, one of each kind; docs/plug-ins.md says what each must have."""
