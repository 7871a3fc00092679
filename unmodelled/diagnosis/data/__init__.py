"""What a diagnosis is given: recordings, sensors, loops, and checks of both."""
