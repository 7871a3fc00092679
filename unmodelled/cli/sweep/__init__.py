"""Read the runs of a sweep: the keys and the results of every run."""
