"""Does it hunt? The verdict on a run or on a measured log."""
