"""Laws of contacts, and the geometry behind them."""
