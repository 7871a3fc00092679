"""Networks as efforts of a known system, and their training; no particular split or figure is known here."""
