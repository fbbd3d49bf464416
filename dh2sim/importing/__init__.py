"""Back to DH: other descriptions of a robot become robot files, compared with what they were made from."""
