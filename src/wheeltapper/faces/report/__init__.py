"""Reports of a wayside site: a page for each train, an index, and a database, from a folder of recordings."""
