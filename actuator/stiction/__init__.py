"""The actuator at rest: what holds it, when it breaks away, and margins against hunting."""
