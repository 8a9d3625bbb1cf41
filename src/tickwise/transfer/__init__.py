"""Transfer of logical structure (Steps 1-3) and of extended Q-functions (Algorithm 2)."""
