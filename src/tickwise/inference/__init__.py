"""Inference of formulas from labelled trajectories (Section III)."""
