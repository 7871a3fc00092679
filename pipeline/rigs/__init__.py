"""Virtual test benches: independent simulations that replace measured data."""
