"""Checks of the project itself: the gear paper, published results of other programs, benchmarks."""
