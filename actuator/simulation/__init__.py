"""Running a hybrid system: windows, events, compiled code, signals, runs."""
