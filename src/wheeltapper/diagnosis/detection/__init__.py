"""Statistics of detection, for any method that looks for flaws: it knows nothing of railways."""
