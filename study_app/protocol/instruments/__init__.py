"""Standard questionnaires: their items and scoring, one TOML file each."""
