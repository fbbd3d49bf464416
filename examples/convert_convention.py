"""Write the same arm in the other convention: numbers move between rows, and the tool stays where it is."""

import numpy as np

from dh2sim import Robot

standard = Robot.load("stanford")
modified = standard.convert("modified")
print(standard)
print(modified)
for note in modified.notes:
    print(f"note: {note}")

q = standard.random_configurations(1000)
print(f"tool0: at most {np.abs(modified.fk(q) - standard.fk(q)).max():.1e} apart at {len(q)} configurations")
modified.save("stanford_modified.yaml", overwrite=True)
