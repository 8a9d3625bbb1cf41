"""Learning and planning over tables: Q-learning on τ-states and on extended states, exact optimal values."""
