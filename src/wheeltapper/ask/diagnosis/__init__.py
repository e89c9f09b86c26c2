"""What a wheelset's bouncing over a site says of it."""
