"""Does it hunt: verdicts, exact orbits, boundaries, rest, margins, causes and remedies."""
