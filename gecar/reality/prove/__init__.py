"""What a robot found is worth on recordings it was not fitted to, and whether what is left is noise."""
