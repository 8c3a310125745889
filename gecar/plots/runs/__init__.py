"""Pictures of evolutions and studies."""
