"""Sites: rails that are designed for a diagnosis, and recordings that are computed over them."""
