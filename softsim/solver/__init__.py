"""The explicit integrator, its stable step, its energy books and its guards."""
