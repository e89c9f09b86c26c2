"""Cross sections of wheels and rails."""
