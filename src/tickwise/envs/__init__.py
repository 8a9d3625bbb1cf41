"""Environments: gridworlds with hidden temporal tasks, as arrays and as Gymnasium environments."""
