"""Questions asked of scenarios and records: maps over parameters."""
