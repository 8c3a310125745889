"""Pictures, films and pages of drives."""
