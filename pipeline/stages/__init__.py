"""The verbs: one file, one function, one DVC stage. Stages never import each other, they meet in files."""
