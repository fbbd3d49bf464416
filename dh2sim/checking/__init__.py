"""Everything that a repository with robots wants checked: files, exports, poses, and a report for its CI."""
