"""Parameters of a liquid from measured motion and force."""
