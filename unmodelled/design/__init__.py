"""What logs can determine, and which experiment, within limits, would determine more."""
