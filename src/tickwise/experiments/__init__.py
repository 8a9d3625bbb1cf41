"""Studies as data, the runner that carries them out, and what shows their results."""
