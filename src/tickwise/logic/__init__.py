"""MITL_f formulas: syntax, parsing, printing, semantics, normal form and structure."""
