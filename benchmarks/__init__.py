"""What Tickwise costs, beside C and other libraries on the same work; ``make bench`` runs all of it."""
