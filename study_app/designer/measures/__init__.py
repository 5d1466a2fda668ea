"""The tab *Measures*: what the open study can find, some numbers at once and some simulated."""
