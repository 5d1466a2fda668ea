"""What is to be run: a TOML file becomes a frozen value, the value with participant and seed a schedule."""
