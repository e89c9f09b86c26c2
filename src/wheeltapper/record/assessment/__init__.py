"""What standards make of a run: filters and weightings, ride comfort, guidance."""
