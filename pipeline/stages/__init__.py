"""Verbs: one file, one function and one DVC stage each. Stages never import each other; they exchange files."""
