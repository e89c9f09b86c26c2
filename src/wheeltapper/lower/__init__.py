"""From descriptions to programs."""
