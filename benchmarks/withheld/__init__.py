"""Withheld: machines from which one effect was taken out, programs that say which one, and their scores."""
