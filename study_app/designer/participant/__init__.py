"""The participant's page in the designer, and playing the study from a step on."""
