"""The numerical floor: plain numbers, marched exactly."""
