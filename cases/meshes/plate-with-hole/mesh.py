"""Writes plate.msh: a square of 1 m with a hole of 60 mm radius as 128 quadrangles around it, in mm (MSH 2.2)."""

from math import cos, pi, sin

HALF, RADIUS, COUNT = 500, 60, 128

nodes = []
for k in range(COUNT):
    angle = 2 * pi * k / COUNT
    x, y = cos(angle), sin(angle)
    nodes.append((RADIUS * x, RADIUS * y))
for k in range(COUNT):
    angle = 2 * pi * k / COUNT
    x, y = cos(angle), sin(angle)
    largest = max(abs(x), abs(y))
    nodes.append((HALF * x / largest, HALF * y / largest))

with open("plate.msh", "w") as file:
    file.write("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n1 1 \"hole\"\n2 2 \"plate\"\n")
    file.write(f"$EndPhysicalNames\n$Nodes\n{len(nodes)}\n")
    for tag, (x, y) in enumerate(nodes, 1):
        file.write(f"{tag} {x:.12g} {y:.12g} 0\n")
    file.write(f"$EndNodes\n$Elements\n{2 * COUNT}\n")
    for k in range(COUNT):
        following = (k + 1) % COUNT
        corners = [k, COUNT + k, COUNT + following, following]
        file.write(f"{k + 1} 3 2 2 2 {' '.join(str(corner + 1) for corner in corners)}\n")
        file.write(f"{COUNT + k + 1} 1 2 1 1 {k + 1} {following + 1}\n")
    file.write("$EndElements\n")
