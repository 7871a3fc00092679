"""The choice among fitted candidates: verdict, named effects, what cannot be told apart, confidence."""
