"""The nouns: what the user describes, frozen and without any computation."""
