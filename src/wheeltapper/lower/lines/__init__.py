"""Rails over which vehicles pass again and again; one file for each march."""
