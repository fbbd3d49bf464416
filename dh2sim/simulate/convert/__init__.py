"""Runs as files of other formats: Parquet tables and HDF5."""
