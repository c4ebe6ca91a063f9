"""Why it hunts, and what helps."""
