"""An emulated Falcon, independent of the driver: it shares only constants of wire and geometry."""
