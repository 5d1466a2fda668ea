"""What accuracy costs in time: ladders of models against truths computed independently, and the clock."""
