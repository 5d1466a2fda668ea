"""3Dconnexion SpaceMouse."""
