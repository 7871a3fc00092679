"""Two forms of the diagnosis on the same cases: rank of the true law, answer, CPU time and harm."""
