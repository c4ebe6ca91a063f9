"""The hybrid system: what the parts of an actuator are put together into, and how."""
