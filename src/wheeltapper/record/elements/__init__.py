"""Events and motion of what is not linear in suspensions, of ends of dampers, and of voids."""
