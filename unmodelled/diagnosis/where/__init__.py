"""Where the gap enters: channels, experiments and regions of operation."""
