"""What a study file says: a scene, what varies in it, what is collected and drawn."""
