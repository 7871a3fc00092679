"""The page of a diagnosis, with its tables and figures."""
