"""What this installation computes, beside closed forms, other programs and published figures."""
