"""Describing functions: the textbook's prediction of hunting, held against simulation."""
