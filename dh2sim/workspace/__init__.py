"""Where a robot's frame can get: voxels, sections with exact boundaries, reach, dexterity."""
