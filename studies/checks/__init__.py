"""Is it right, and how fast is it: the gear paper, others' numbers, benchmarks."""
