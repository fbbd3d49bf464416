"""The text of docs/imported-robots.md between its tables."""

HEAD = """\
# Imported robots

Does `dh2sim import` work on robots from outside this project? Here are {arms} arms and legs from {files}
public files, {joints} joints in all, imported as they are. All of them have a Denavit-Hartenberg
table, and two measurements show that it is theirs:

- **residual**: the greatest distance and angle between the robot file that was written, read back, and the source's
  joints and tip as dh2sim reads them, at 1000 random configurations. The import itself measures it, and
  refuses to write what is above the tolerance ({tolerance:.0e} unless `--tolerance` says otherwise).
- **by pinocchio**, **by MuJoCo**: the greatest distance and angle between the table's tool and the tip in the same
  file, read by a program that shares no code with dh2sim, at {configurations} random configurations. This one would
  also find a mistake of the reader.

An angle or length within the tolerance of a simple number becomes that number, as long as the whole table stays
within the tolerance: this is why some residuals are 1e-11 and not 1e-16.

## The robots

*From → to* is what became base_link and tool0; *options* are those of `dh2sim import` besides the file. Without
an option the import found the ends by itself.
"""

COMPARED = """\
## Compared with published tables

Makers and toolboxes publish tables of some of these robots. Which way an x points, where parallel axes get their d,
and where the base and the tool are is a free choice; nothing else is. So a published and an imported table describe
the same arm if there are a constant pose in front of one and another constant pose, E, behind it so that both tools
agree at *all* coordinates. Coordinates are not shifted and no joint is reversed: the import keeps every joint's
zero and sense.

The left half of each table is published, the right half imported; theta is the offset that the coordinate adds to.
"""

ELSEWHERE = """\
## Files that are not the robot of the table

An import contains what is in the file. Compared with a published table, that shows where a file describes another
robot.
"""

FINDINGS = """\
### ABB IRB 140

`abb_irb140_description/urdf/irb140.urdf` of rtb-data has an upper arm of 1.42 m and a forearm of 1.49 m. By the
Robotics Toolbox's table of the IRB 140, after ABB's data sheet, they are 0.36 m and 0.38 m: the file describes
a larger robot under this name.
"""

REPEAT = """\
## How this was made

    pip install -e '.[test]'
    python scripts/imported_robots.py --folder wheels

downloads the packages in the versions above into `wheels` (or uses those that are there), unpacks the
descriptions, imports every arm, and writes this page; `--check` compares with it instead, but for the digits of
errors that are rounding. The lists of arms and of published tables are in `scripts/real_arms`.
`tests/importing/test_real_robots.py` imports the same arms out of those of the packages that are installed, and
takes them all the way: file → table → URDF → pinocchio. `tests/test_imported_robots_page.py` computes the poses of
the tables that are printed here.
"""
