"""The frequency-response report."""
