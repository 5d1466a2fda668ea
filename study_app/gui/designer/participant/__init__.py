"""The participant's page in the designer."""
