"""Effects that models of mechatronic systems leave out, one family per file."""
