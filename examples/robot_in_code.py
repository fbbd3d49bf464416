"""Make a robot of the rows of its DH table, look at it, and write it as URDF, MJCF and robot file."""

from math import pi

from dh2sim import Fixed, LinkSpec, Prismatic, Revolute, Robot

arm = Robot(
    [
        Revolute(d=0.4, alpha=-pi / 2, limits=(-pi, pi)),
        Revolute(d=0.15, alpha=pi / 2, limits=(-pi / 2, pi / 2)),
        Prismatic(limits=(0.1, 1.2), link=LinkSpec(mass=2.5)),
        Fixed(theta=pi / 4, name="bracket"),
    ],
    name="my_arm",
    tool=(0.0, 0.0, 0.1),
    configurations={"home": [0.0, 0.5, 0.6]},
)
print(arm)
print(f"\ntool0 at home:\n{arm.fk('home').round(4)}")

report = arm.export("build")
for file in report.files:
    print(f"wrote {file.path}, {file.size} bytes")
for check in report.verified:
    print(f"{check.format}: off the table by at most {check.position_error:.1e} m")
for loss in report.losses:
    print(f"not carried over: {loss}")
for filled_in in (*report.estimates, *report.assumptions):
    print(filled_in.sentence)

arm.save("my_arm.yaml", overwrite=True)
print(repr(Robot.load("my_arm.yaml")))
