"""Tables, numbers and claims of the dissertation's chapters."""
