"""The page, the API, the stream and the metrics of a running service."""
