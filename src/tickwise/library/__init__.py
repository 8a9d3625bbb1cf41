"""A library of learned tasks: formulas, automata and Q-functions in a folder, to be ranked and transferred."""
