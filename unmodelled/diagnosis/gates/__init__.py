"""Gates of an answer: what leaves is read back, has possible numbers, and predicts whole runs no worse."""
