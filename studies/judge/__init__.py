"""The verdict on one case, with its causes and remedies."""
