"""Train recurrent networks on sequences of different length (section 5.4.2)."""
