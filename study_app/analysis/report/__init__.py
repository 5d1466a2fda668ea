"""The report: findings in words, tables and figures, with everything needed to check them."""
