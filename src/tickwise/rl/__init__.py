"""Learning over tables: Q-learning, and other forms of learning, on τ-states and on extended states."""
