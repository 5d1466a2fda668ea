"""Protocols: a TOML file becomes a frozen value; the value, participant and seed give a schedule."""
