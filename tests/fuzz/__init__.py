"""Whatever a user hands over is read, or refused in one line; nothing in it is executed."""
