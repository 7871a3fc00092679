"""How well a structure explains recordings: free runs of it and the parameters that fit best."""
