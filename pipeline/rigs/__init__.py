"""Virtual test benches: independent simulations that stand in for measured data."""
