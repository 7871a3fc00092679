"""A system that a user writes down: `system/1` files, symbolically."""
