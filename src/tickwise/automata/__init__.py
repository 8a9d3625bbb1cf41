"""Timed automata: from formulas in SDNF to tables that a learner steps through."""
