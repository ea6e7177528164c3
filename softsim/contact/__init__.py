"""Contact: gap and normal, normal law, friction law, and the term that combines them."""
