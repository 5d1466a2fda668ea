"""A text with everything that a careless writer of lines gets wrong."""

AWKWARD = 'comma, "quote",\nnew line\r\n\ttab 🌊 \u2028\x85 =SUM(A1)' + "é" * 10_000
