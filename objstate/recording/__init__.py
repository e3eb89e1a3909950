"""What objstate writes: logs, Parquet tables, paths, run summaries."""
