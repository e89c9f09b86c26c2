"""Tables in text files, as measuring programs write them; and the units in their headers."""
