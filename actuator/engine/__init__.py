"""The engine: an exponential integrator that runs a HybridSystem from event to event; it knows no physics."""
