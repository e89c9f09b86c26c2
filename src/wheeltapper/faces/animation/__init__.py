"""Moving pictures of records: what moves (scenes), and how it is written (pictures, pages)."""
