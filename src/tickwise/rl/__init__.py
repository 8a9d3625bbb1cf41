"""Learning over tables: Q-learning on τ-states and on extended states."""
