"""The one folder that knows MLflow."""
