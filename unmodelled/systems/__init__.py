"""System files (`system/1`): reader, writer, and the symbolic model of a system."""
