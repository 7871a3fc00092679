"""Known physics: mechanisms and the functions generated from them."""
