"""From a march to a record that answers any time, in SI units and with labels."""
