"""Convert published measurements to log folders: original files and units, divided into experiments."""
