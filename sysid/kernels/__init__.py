"""Compiled recursions: free run and forward sensitivities."""
