"""How many participants a protocol needs: simulated studies, judged by the protocol's own tests."""
