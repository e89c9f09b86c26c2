"""The ground floor: errors, outcomes and quantities, on the standard library alone."""
