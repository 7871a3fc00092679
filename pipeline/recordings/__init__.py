"""Published measurements as log folders: files and units as their authors left them, cut into experiments."""
