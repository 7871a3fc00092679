"""Verbs: one file, one function and one DVC stage each; stages exchange files and never import each other."""
