"""The designer's tab Measures: what the open study can find."""
